"""Figures and reports of structures on a line, in a plane and in space, with few instruments."""

import dataclasses
import io
import itertools

import numpy as np
import pandas as pd
import pytest

import bayes_placement as bp
from bayes_placement.cli import _run
from bayes_placement.cli._result_folder import ResultFolder
from bayes_placement.cli._terminal import Screen
from bayes_placement.criticism.findings.findings import Model, findings
from bayes_placement.criticism.reach.reach import Reach
from bayes_placement.io import netcdf
from bayes_placement.laws import Spring
from bayes_placement.plots import ledger as ledger_plots
from bayes_placement.plots import reach as reach_plots
from bayes_placement.plots import report as report_writer
from bayes_placement.plots import structure as structure_plots
from bayes_placement.plots.report import Report, write_report
from bayes_placement.plots.report._style import look
from tests.in_space import Linear
from tests.plots.test_ledger import ranking

BOXES = {
    "upright": ((0.0, 0.0, 0.0), (0.0, 0.0, 0.6)),
    "plane": ((0.0, 0.0, 0.0), (1.0, 0.8, 0.0)),
    "space": ((0.0, 0.0, 0.0), (1.0, 0.8, 0.6)),
}
CASES = [
    (shape, instruments)
    for shape in ("line", *BOXES)
    for instruments in ("FRFs", "shapes", "frequencies")
]
ALL_DIFFER = [("line", "FRFs"), ("upright", "shapes"), ("plane", "frequencies"), ("space", "FRFs")]
FURTHER = [pytest.mark.long, pytest.mark.longest]


def structure(shape):
    if shape == "line":
        return bp.beams.bar(
            4, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0, ends="fixed-fixed"
        )
    return Linear(box=BOXES[shape])


def experiment(shape, instruments):
    """An experiment on one sensor and one actuator, on shapes at a sensor, or on frequencies."""
    modes = structure(shape)
    middle = 0.4 if shape == "line" else tuple(0.4 * np.array(BOXES[shape][1]))
    sensors = [bp.Sensor("s1", at=middle, directions=(1,))] if instruments != "frequencies" else []
    of_modes = bp.ModalParameters([40.0, 70.0], [0.1, 0.2], number=[1, 2])
    if instruments == "shapes":
        of_modes = bp.ModalParameters(
            [40.0, 70.0], [0.1, 0.2], number=[1, 2], shape=[[1.0, 0.5]], sensors=["s1+x"],
            shape_deviation=[[0.1, 0.1]],
        )  # fmt: skip
    damped = bp.Structure(modes, damping=bp.damping.Modal(0.03))
    if instruments != "FRFs":
        observe, noise = bp.observe.ModalData(of_modes), bp.noise.FromVariance()
        return bp.Experiment(damped, sensors=sensors, observe=observe, noise=noise), of_modes
    made = bp.Experiment(
        damped,
        sensors=sensors,
        actuators=[bp.Actuator("a1", at=middle, directions=(1,))],
        frequency=[30.0, 50.0, 60.0],
        observe=bp.observe.Complex("velocity"),
        noise=bp.noise.Gaussian(0.1),
    )
    return made, bp.Measurement.from_arrays(
        np.ones(3, complex),
        [30.0, 50.0, 60.0],
        sensors="s1+x",
        actuators="a1+x",
        quantity="mobility",
    )


def scores(shape):
    """Scores of two kinds at three places, and of one without a place."""
    ends = (
        np.array([0.0, 0.0, 0.0]),
        np.array([1.0, 0.0, 0.0] if shape == "line" else BOXES[shape][1]),
    )
    places = [(1 - share) * ends[0] + share * ends[1] for share in (0.1, 0.5, 0.9)]
    rows = [
        (kind, number, *place, 5.0 * number - 9.0)
        for number, kind in enumerate(("point_mass", "ground_spring"))
        for place in places
    ]
    rows.append(("time_delay", 2, np.nan, np.nan, np.nan, 3.0))
    table = pd.DataFrame(rows, columns=["kind", "variant", "x", "y", "z", "score"])
    on_a_line = shape == "line"
    table["at"] = table["x"] if on_a_line else np.nan
    return table.drop(columns=["x", "y", "z"] if on_a_line else []).assign(p_value=1e-9)


@pytest.mark.parametrize(("shape", "instruments"), CASES)
def test_structures_and_maps_of_suspicion_are_drawn(shape, instruments):
    made, _ = experiment(shape, instruments)
    figure = ledger_plots.suspicion(ranking(scores(shape)), experiment=made)
    assert "suspicion" in figure.axes[0].get_title()
    drawn = structure_plots.experiment(made).axes[0]
    named = [label.split()[0] for label in drawn.get_legend_handles_labels()[1]]
    assert ("sensor" in named) == bool(made.sensor)
    assert ("actuator" in named) == bool(made.actuator)


def reached(shape):
    """What springs could do at three places, and a factor on a channel."""
    table = scores(shape).query("kind == 'point_mass'").filter(["x", "y", "z"])
    places = table.assign(acts_on="displacement", setting="along x")
    channel = pd.DataFrame({"acts_on": ["channel"], "setting": "sensor s1, channel +x"})
    rows = pd.concat([places, channel], ignore_index=True)
    ends = dict.fromkeys(("to_x", "to_y", "to_z"), np.nan)
    curves = rows.assign(**ends, any_law=0.9, few_numbers=[0.1, 0.8, 0.3, 0.2], log_evidence=-1.0)
    laws = (
        curves.iloc[[1, 3]].drop(columns="any_law").assign(probability=[0.9, 0.1], law=Spring(1e3))
    )
    return Reach(curves, laws, 5.0, {}, fails=True)


@pytest.mark.parametrize("is_known", [True, False])
@pytest.mark.parametrize("shape", BOXES)
def test_what_laws_reach_is_drawn_on_every_structure(shape, is_known):
    made, _ = experiment(shape, "FRFs")
    figure = reach_plots.curves(reached(shape), experiment=made if is_known else None)
    figure.draw_without_rendering()
    drawn, of_channels, *_ = figure.axes
    assert drawn.name == ("3d" if shape == "space" else "rectilinear")
    along = drawn.get_ylabel().replace("\n", " ") == reach_plots.SHARE
    assert along == (shape == "upright")
    assert of_channels.name == "rectilinear"
    assert drawn.get_title().split()[:2] == ["displacement:", "spring"]


def test_a_structure_along_one_line_in_space_is_drawn_along_it():
    made, _ = experiment("upright", "FRFs")
    found = reached("upright")
    aside = found.curves.assign(few_numbers=0.0)  # along another direction, less at each place
    found = dataclasses.replace(found, curves=pd.concat([aside, found.curves]))
    panel = reach_plots.curves(found, experiment=made).axes[0]
    (curve,) = (line for line in panel.lines if line.get_label() == "a law of few numbers")
    np.testing.assert_allclose(curve.get_xydata(), [[0.06, 10.0], [0.3, 80.0], [0.54, 30.0]])
    (sensor,) = (line for line in panel.lines if line.get_label() == "sensor as recorded")
    np.testing.assert_allclose(sensor.get_xdata(), 0.24)
    assert panel.get_xlabel() == "place along the structure, z [m]"
    places = {"point_mass": (0.0, 0.0, 0.3)}
    strips, _ = ledger_plots.suspicion(ranking(scores("upright")), places=places).axes
    assert strips.get_xlabel() == "place along the structure, z [m]"
    np.testing.assert_allclose(strips.lines[0].get_xdata(), 0.3)
    assert strips.get_xlim() == pytest.approx((0.06, 0.54))


def of_ends(curves):
    """The same rows of struts that all end at one place."""
    return curves.assign(acts_on="relative", to_x=0.9, to_y=0.7, to_z=0.0)


def test_a_strut_has_a_star_at_both_ends_of_a_map():
    found = reached("plane")
    only = {name: of_ends(getattr(found, name).iloc[:-1]) for name in ("curves", "laws")}
    found = dataclasses.replace(found, **only)
    panel = reach_plots.curves(found).axes[0]
    stars = [line.get_xydata()[0] for line in panel.lines if line.get_marker() == "*"]
    np.testing.assert_allclose(stars, [[0.5, 0.4], [0.9, 0.7]])
    assert "relative at 500, 400, 0 mm to 900, 700, 0 mm: " in found.words()[-1]
    near = found.laws.assign(to_x=0.5001, to_y=0.4)  # the nearest node is another
    (told, *_) = dataclasses.replace(found, laws=near).words()[::-1]
    assert "relative at 500, 400, 0 mm: " in told


def test_the_scale_of_colours_stands_right_beside_the_map():
    figure = reach_plots.curves(reached("plane"), experiment=experiment("plane", "FRFs")[0])
    figure.savefig(io.BytesIO())
    panel = figure.axes[0]
    (bar,) = panel.child_axes
    assert bar.get_ylabel() == reach_plots.SHARE
    box, beside = panel.get_window_extent(), bar.get_window_extent()
    assert 0 < (beside.x0 - box.x1) / figure.dpi < 0.15
    assert (beside.y0, beside.y1) == pytest.approx((box.y0, box.y1))
    assert bar.get_tightbbox().x1 <= figure.bbox.x1
    # The map stands in the middle of the figure.
    assert abs(box.x0 + box.x1 - figure.bbox.x1) < 0.2 * figure.bbox.x1


def test_the_title_of_a_narrow_map_is_not_broken():
    found = reached("plane")
    tables = {name: getattr(found, name) for name in ("curves", "laws")}
    narrow = {name: table.assign(x=0.2 * table["x"]) for name, table in tables.items()}
    with look():  # of a report
        figure = reach_plots.curves(dataclasses.replace(found, **narrow))
        figure.savefig(io.BytesIO())
    panel = figure.axes[0]
    assert panel.get_window_extent().width < panel.title.get_window_extent().width
    assert "\n" not in panel.get_title()


def test_of_very_many_channels_the_greatest_have_bars():
    found = reached("plane")
    channels = [
        found.curves.tail(1).assign(setting=f"sensor s{n}", few_numbers=n / 40) for n in range(40)
    ]
    many = pd.concat([found.curves.head(3), *channels], ignore_index=True)
    figure = reach_plots.curves(dataclasses.replace(found, curves=many))
    figure.savefig(io.BytesIO())
    panel = figure.axes[1]
    names = [label.get_text() for label in panel.get_yticklabels()]
    assert names == [f"s{n}" for n in range(24, 40)]
    assert panel.get_xlabel() == "misfit removed [%]; 24 more channels remove less"
    boxes = [label.get_window_extent() for label in panel.get_yticklabels()]
    assert all(low.y0 > high.y1 for low, high in itertools.pairwise(boxes))


def test_a_report_draws_suspicion_along_a_line_in_space(tmp_path):
    made, measured = experiment("upright", "FRFs")
    about = {"command": "check", "verdict": "It fits.", "sentences": ["It fits."], "warnings": []}
    tree = findings([Model("as given", made, {})], {}, measured, about)
    netcdf.write(tree, tmp_path / "findings.nc")
    scores("upright").to_csv(tmp_path / "suspicion.csv", index=False)
    page = write_report(tmp_path).read_text()
    assert "place along the structure, z [m]" in page


@pytest.mark.parametrize(
    ("shape", "instruments"),
    [
        pytest.param(*case, marks=[] if case in ALL_DIFFER else FURTHER, id="-".join(case))
        for case in CASES
    ],
)
def test_reports_are_written_with_every_section(tmp_path, shape, instruments):
    made, measured = experiment(shape, instruments)
    about = {"command": "check", "verdict": "It fits.", "sentences": ["It fits."], "warnings": []}
    models = [Model("as given", made, {}), Model("with an effect", made, {})]
    netcdf.write(findings(models, {}, measured, about), tmp_path / "findings.nc")
    (chapter,) = Report.read(write_report(tmp_path)).chapters
    assert chapter.items
    assert not [item.title for item in chapter.items if item.title.startswith("Not drawn")]


def fails(*_):
    raise IndexError("too many indices")


def test_a_section_that_fails_is_a_sentence_and_the_others_are_written(tmp_path, monkeypatch):
    made, measured = experiment("line", "frequencies")
    about = {"command": "check", "verdict": "It fits.", "sentences": ["It fits."], "warnings": []}
    tree = findings([Model("as given", made, {})], {}, measured, about)
    netcdf.write(tree, tmp_path / "findings.nc")
    sections = {"a part": fails, **report_writer._SECTIONS}
    monkeypatch.setattr(report_writer, "_SECTIONS", sections)
    (chapter,) = Report.read(write_report(tmp_path)).chapters
    told = [item for item in chapter.items if item.title.startswith("Not drawn")]
    assert "IndexError: too many indices" in told[0].content.sentences[0]
    assert len(chapter.items) > 1


def test_a_figure_that_fails_ends_no_run(tmp_path, capsys):
    study = tmp_path / "study.py"
    study.write_text("")
    run = _run.Output(ResultFolder(tmp_path / "out", tmp_path / "out")).begin("explain", study)
    run.verdict("A mass is missing.")
    assert "A mass is missing." in (tmp_path / "out" / "run.json").read_text()
    made, _ = experiment("line", "FRFs")
    run.figures(fails, lambda: {"good.png": structure_plots.experiment(made)})
    assert run.finish(Screen.of(False, False), "A mass is missing.", {}) == 0
    assert (tmp_path / "out" / "good.png").is_file()
    assert "A figure was not drawn (IndexError: too many indices)" in capsys.readouterr().out
