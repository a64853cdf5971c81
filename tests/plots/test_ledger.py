"""Figures of a ledger and of a ranking: values, units and legends."""

import functools
import io
import itertools
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

import bayes_placement as bp
from bayes_placement._shared.labels import AS_DRAWN
from bayes_placement.criticism.missing.fitted_model import FittedModel
from bayes_placement.criticism.missing.ledger import Ledger
from bayes_placement.criticism.missing.ranking import Ranking
from bayes_placement.criticism.noise_needed import NoiseNeeded
from bayes_placement.plots import ledger as ledger_plots
from bayes_placement.plots._falling import Falling, draw_falling
from bayes_placement.plots._fit_panels import OUTSIDE
from tests.in_space import Linear

UNIT = "velocity per force [(m/s)/N]"
PLACES = np.array([0.1, 0.4, 0.7])
PROBABILITIES = {
    "point_mass": 0.9,
    "ground_spring": 0.06,
    "gain_error": 1e-5,
    "nothing_missing": 0.01,
    "none_of_these": 0.03,
}


def scores():
    """Two kinds with a place, one of them with two settings; a gain; a sensor that is shifted."""
    rows = [
        ("point_mass", 0, at, score) for at, score in zip(PLACES, (3.0, -40.0, 8.0), strict=True)
    ]
    rows += [("ground_spring", 1, at, s) for at in PLACES for s in (10 * at, -20 * at)]
    rows += [("gain_error", n, np.nan, score) for n, score in ((2, 1.0), (3, -2.0))]
    rows += [("misplaced_sensor", 4, shift, 30.0 + shift) for shift in (-0.2, 0.2)]
    table = pd.DataFrame(rows, columns=["kind", "variant", "at", "score"])
    return table.assign(p_value=np.where(table["kind"] == "gain_error", 0.2, 1e-9))


IN_SPACE = np.array([[0.1, 0.2, 0.3], [0.9, 0.7, 0.5], [0.4, 0.6, 0.1]])


def scores_in_space(flat=False):
    """Five kinds with a place, the last of which is not drawn, and one that has none."""
    kinds = ["point_mass", "ground_spring", "gain_error", "axial_preload", "mount_resonance"]
    rows = [
        (kind, number, *place, score)
        for number, kind in enumerate(kinds)
        for place, score in zip(IN_SPACE, (9.0 - number, -40.0 + number, 1.0), strict=True)
    ]
    rows.append(("time_delay", 5, np.nan, np.nan, np.nan, 60.0))
    table = pd.DataFrame(rows, columns=["kind", "variant", "x", "y", "z", "score"])
    table["z"] = table["z"] * (0.0 if flat else 1.0)
    return table.assign(at=np.nan, p_value=1e-9)


def in_space():
    """Return an experiment on a structure in space that is read nowhere here."""
    return bp.Experiment(
        bp.Structure(Linear(), damping=bp.damping.Modal(0.03)),
        sensors=[bp.Sensor("s1", at=(0.2, 0.3, 0.1))],
        actuators=[bp.Actuator("a1", at=(0.9, 0.1, 0.5))],
        frequency=[150.0],
        observe=bp.observe.Complex("velocity"),
        noise=None,
    )


def step(added, chi2):
    effects = () if added is None else (added,)
    return FittedModel(added, effects, {}, chi2, 0.5, -3.0, None, -1.0)


def ledger(*steps):
    models = steps or (step(None, 1234.0), step("point_mass", 7.5), step("gain_error", 1.04))
    return Ledger(
        steps=models,
        verdict=("gain_error", "point_mass"),
        probabilities=PROBABILITIES,
        confounded=(),
        unexplained=False,
        seconds=1.0,
        experiment=EXPERIMENT,
        given=EXPERIMENT,
        measurement=bp.ModalParameters([100.0], [1.0]),
        compared=pd.DataFrame(),
        suspicion=scores(),
        alternatives=(),
    )


def ranking(table=None):
    return Ranking((), PROBABILITIES, (), scores() if table is None else table, ())


def fit(seed, parts=True, levels=1):
    random = np.random.default_rng(seed)
    lines = np.array([10.0, 20.0, 40.0, 80.0])
    level = ("force_level",) if levels > 1 else ()
    dims = ("sensor", "actuator", *level, "frequency")
    size = (2, 1, levels, lines.size) if level else (2, 1, lines.size)
    logarithm = f"log10 of {UNIT}"
    unit = UNIT if parts else logarithm
    units = {"measured": logarithm, "predicted": logarithm, "error": unit, "noise": unit}
    coordinates = {
        "sensor": ["s1", "s2"],
        "actuator": ["a1"],
        "frequency": ("frequency", lines),
    }
    if levels > 1:
        coordinates["force_level"] = [0.5, 2.0]
    arrays = {
        name: (dims, np.abs(random.normal(size=size)) + 0.1, {"units": label})
        for name, label in units.items()
    }
    dataset = xr.Dataset(arrays, coords=coordinates)
    dataset["measured"][0, 0, ..., 1] = np.nan  # nothing was measured there
    return dataset


def fits(**case):
    return {"as given": fit(1, **case), "with point_mass": fit(2, **case)}


def tiny():
    return bp.Experiment(
        bp.Structure(
            bp.beams.bar(2, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0),
            damping=bp.damping.Modal(0.03),
        ),
        sensors=[bp.Sensor("s1", at=0.2)],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=[150.0],
        observe=bp.observe.Complex("velocity"),
        noise=None,
    )


EXPERIMENT = tiny()

FITTED_PLACES = {"point_mass": (0.3, 0.4, 0.5)}
FIGURES = {
    "suspicion": lambda: ledger_plots.suspicion(ranking(), places={"point_mass": 0.37}),
    "suspicion in space": lambda: ledger_plots.suspicion(
        ranking(scores_in_space()), places=FITTED_PLACES, experiment=in_space()
    ),
    "suspicion in a plane": lambda: ledger_plots.suspicion(
        ranking(scores_in_space(flat=True)), places=FITTED_PLACES
    ),
    "probabilities of a ranking": lambda: ledger_plots.probabilities(ranking()),
    "probabilities of a ledger": lambda: ledger_plots.probabilities(ledger()),
    "error_falls": lambda: ledger_plots.error_falls(ledger()),
    "before_and_after": lambda: ledger_plots.before_and_after(fits()),
    "before_and_after of logarithms": lambda: ledger_plots.before_and_after(fits(parts=False)),
    "before_and_after at two levels": lambda: ledger_plots.before_and_after(fits(levels=2)),
}


def drawn(figure):
    """Draw a figure; a warning of the layout or of a missing value is an error in this suite."""
    figure.draw_without_rendering()
    return figure


def labels(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def line(axis, label):
    (curve,) = [line for line in axis.lines if line.get_label() == label]
    return curve.get_ydata()


def words(axis):
    return [text.get_text() for text in axis.texts]


def names(axis):
    return [label.get_text() for label in axis.get_yticklabels()]


NOISES = [NoiseNeeded(0.3, 4.3, 0.0), NoiseNeeded(0.17, 2.5, 0.0)]
TAKEN_UP = [NoiseNeeded(0.015, 0.99, 0.9)] * 2


@pytest.mark.parametrize(
    ("change", "shown", "quantity"),
    [
        ({"noise_needed": NOISES}, [30.0, 17.0], "noise needed, of the amplitude [%]"),
        ({"chi2_when_exact": [400.0, 20.0]}, [400.0, 20.0], "without model error"),
        (
            {
                "noise_needed": TAKEN_UP,
                "noise_needed_when_exact": NOISES,
                "chi2_when_exact": [1.0, 1.0],
            },
            [30.0, 17.0],
            "noise needed without model error, of the amplitude [%]",
        ),
    ],
)
def test_the_error_that_falls_is_none_that_noise_or_model_error_take_up(change, shown, quantity):
    exact = (step(None, 1.0), step("point_mass", 1.0))
    changes = [
        dict(zip(change, values, strict=True)) for values in zip(*change.values(), strict=True)
    ]
    steps = [replace(template, **each) for template, each in zip(exact, changes, strict=True)]
    (panel,) = ledger_plots.error_falls(ledger(*steps)).axes
    np.testing.assert_allclose(panel.lines[0].get_ydata(), shown)
    assert quantity in panel.get_ylabel()


def test_noise_that_is_needed_stands_above_the_scatter_of_neighbouring_lines():
    steps = step(None, 1.0), step("point_mass", 1.0)
    for over_scatter, count in ((2.5, 2), (np.nan, 1)):
        noises = NOISES[0], replace(NOISES[1], over_scatter=over_scatter)
        of_noises = [
            replace(of, noise_needed=noise) for of, noise in zip(steps, noises, strict=True)
        ]
        (panel,) = drawn(ledger_plots.error_falls(ledger(*of_noises))).axes
        assert len(panel.lines) == count
        if count == 2:
            np.testing.assert_allclose(line(panel, "scatter of neighbouring lines"), 17.0 / 2.5)


@functools.cache
def figure_of(name):
    return drawn(FIGURES[name]())


@pytest.mark.parametrize("name", FIGURES)
def test_every_axis_bears_a_name_and_a_unit(name):
    for axis in figure_of(name).axes:
        assert axis.get_xlabel().endswith("]") or not axis.get_xlabel()
        assert axis.get_ylabel().endswith("]") or not axis.get_ylabel()
        assert axis.get_xlabel() or axis.get_ylabel()
        assert axis.name != "3d" or axis.get_zlabel() == "z [m]"


@pytest.mark.parametrize("name", [name for name in FIGURES if "prob" not in name])
def test_one_legend_stands_above_the_panels(name):
    figure = figure_of(name)
    (legend,) = figure.legends
    bottom = legend.get_window_extent().y0
    assert all(axis.get_tightbbox().y1 <= bottom for axis in figure.axes)
    assert len(labels(figure)) == len(set(labels(figure))) >= 2


@pytest.mark.parametrize("kind", ["misplaced_sensor", "misplaced_actuator"])
def test_a_shift_is_no_place(kind):
    shifted = scores().replace({"kind": {"misplaced_sensor": kind}})
    mapped = ledger_plots.suspicion(replace(ranking(), suspicion=shifted)).axes[0]
    row = names(mapped).index(kind)
    strips = {round(mesh.get_coordinates()[0, 0, 1] + 0.4) for mesh in mapped.collections}
    assert row not in strips


def test_the_map_shows_the_greatest_score_at_each_place():
    mapped = ledger_plots.suspicion(ranking()).axes[0]
    assert names(mapped) == ["gain_error", "ground_spring", "misplaced_sensor", "point_mass"]
    strips = {round(mesh.get_coordinates()[0, 0, 1] + 0.4): mesh for mesh in mapped.collections}
    assert set(strips) == {1, 3}  # what a misplaced sensor has is a shift, not a place
    np.testing.assert_allclose(strips[3].get_array().ravel(), [3.0, 40.0, 8.0])
    np.testing.assert_allclose(strips[1].get_array().ravel(), 20 * PLACES)
    edges = strips[3].get_coordinates()[0, :, 0]
    assert np.all((edges[:-1] < PLACES) & (edges[1:] > PLACES))
    assert {mesh.norm.vmax for mesh in strips.values()} == {40.0}
    assert words(mapped) == ["no place"] * 2


def test_bars_say_how_suspect_each_kind_is_and_whether_by_chance():
    ranked = ledger_plots.suspicion(ranking()).axes[1]
    bars = {round(bar.get_y() + 0.4): bar for bar in ranked.patches}
    assert [bars[n].get_width() for n in range(4)] == [2.0, 14.0, 30.2, 40.0]
    chance = [bars[n].get_facecolor() == to_rgba("0.7") for n in range(4)]
    assert chance == [True, False, False, False]
    assert words(ranked) == ["2", "14", "30.2", "40"]


def test_the_place_that_was_found_is_marked_on_its_strip():
    places = {"point_mass": 0.37, "another": 0.9}
    figure = ledger_plots.suspicion(ranking(), places=places)
    (star,) = figure.axes[0].lines
    assert (list(star.get_xdata()), list(star.get_ydata())) == ([0.37], [3])
    assert "place as fitted" in labels(figure)
    assert "place as fitted" not in labels(ledger_plots.suspicion(ranking()))


def maps(figure):
    return [axis for axis in figure.axes if axis.get_title().startswith("suspicion of ")][:-1]


@pytest.mark.parametrize("flat", [False, True])
def test_a_structure_in_space_has_a_map_of_each_of_the_most_suspect_kinds(flat):
    figure = drawn(ledger_plots.suspicion(ranking(scores_in_space(flat)), places=FITTED_PLACES))
    assert [axis.get_title().removeprefix("suspicion of ") for axis in maps(figure)] == [
        "point_mass",
        "ground_spring",
        "gain_error",
        "axial_preload",
    ]
    assert {axis.name for axis in maps(figure)} == {"rectilinear" if flat else "3d"}
    for number, axis in enumerate(maps(figure)):
        (marks,) = axis.collections
        assert sorted(marks.get_array()) == [1.0, 9.0 - number, 40.0 - number]


@pytest.mark.parametrize(
    ("size", "length", "rows", "columns"),
    [((2.0, 0.1, 0.15), 3.3, 4, 1), ((0.03, 0.02, 1.0), 3.0, 1, 2), ((1.0, 0.8, 0.02), 1.3, 2, 2)],
    ids=["frame", "mast", "plate"],
)
def test_maps_of_a_thin_structure_use_the_space_of_the_figure(size, length, rows, columns):
    thin = bp.Experiment(
        bp.Structure(Linear(box=((0.0, 0.0, 0.0), size)), damping=bp.damping.Modal(0.03)),
        sensors=[bp.Sensor("s1", at=(0.0, 0.0, 0.0))],
        actuators=[bp.Actuator("a1", at=size)],
        frequency=[150.0],
        observe=bp.observe.Complex("velocity"),
        noise=None,
    )
    table = scores_in_space()
    table[["x", "y", "z"]] *= np.array(size) / IN_SPACE.max(axis=0)
    figure = drawn(ledger_plots.suspicion(ranking(table), experiment=thin))
    shown = [axis for axis in figure.axes if axis.get_title().startswith("suspicion of")][:-1]
    cells = [axis.get_subplotspec() for axis in shown]
    assert len({cell.rowspan.start for cell in cells}) == rows
    assert len({cell.colspan.start for cell in cells}) == columns
    for axis in shown:
        span = [np.ptp(axis.get_xlim()), np.ptp(axis.get_ylim())]
        scale = axis.get_window_extent().size / figure.dpi / span  # [inch/m]
        np.testing.assert_allclose(*scale, rtol=1e-6)
        assert scale[0] * max(size) > length
    assert figure.get_figheight() <= 11.0


def test_only_the_map_of_a_kind_that_was_found_bears_its_place():
    figure = ledger_plots.suspicion(ranking(scores_in_space(flat=True)), places=FITTED_PLACES)
    stars = [
        np.transpose(line.get_data()).tolist()
        for axis in maps(figure)
        for line in axis.lines
        if line.get_label() == "place as fitted"
    ]
    assert stars == [[[0.3, 0.4]]]


def test_bars_beside_the_maps_show_all_kinds():
    figure = ledger_plots.suspicion(
        ranking(scores_in_space()), places=FITTED_PLACES, experiment=in_space()
    )
    (ranked,) = (axis for axis in figure.axes if axis.get_title() == "suspicion of each kind")
    assert names(ranked)[::-1] == [
        "time_delay",
        "point_mass",
        "ground_spring",
        "gain_error",
        "axial_preload",
        "mount_resonance",
    ]
    assert words(ranked) == ["36", "37", "38", "39", "40", "60"]
    assert set(labels(figure)) == {
        "structure",
        "sensor as recorded",
        "actuator as recorded",
        "greatest of these places",
        "place as fitted",
        "more than chance (corrected p < 0.01)",
    }


def test_candidates_without_places_are_drawn_alone():
    figure = drawn(ledger_plots.suspicion(ranking(scores().query("kind == 'gain_error'"))))
    assert not figure.axes[0].collections
    assert words(figure.axes[0]) == ["no place"]


@pytest.mark.parametrize("result", [ranking, ledger])
def test_each_probability_has_a_bar_with_its_figure(result):
    axis = ledger_plots.probabilities(result()).axes[0]
    assert names(axis)[::-1] == [
        "point_mass",
        "ground_spring",
        "none_of_these",
        "nothing_missing",
    ]
    np.testing.assert_allclose(
        [bar.get_width() for bar in axis.patches], sorted(PROBABILITIES.values())[1:]
    )
    assert words(axis)[::-1] == ["0.900", "0.060", "0.030", "0.010"]
    assert axis.get_title() == "probability of each kind (1 more below 0.001)"


def test_the_error_falls_step_by_step_to_the_noise():
    axis = ledger_plots.error_falls(ledger()).axes[0]
    np.testing.assert_array_equal(line(axis, "misfit of the best fit"), [1234.0, 7.5, 1.04])
    assert set(line(axis, "noise floor of a correct model")) == {1.0}
    assert [text.get_text() for text in axis.get_xticklabels()] == [
        "as given",
        "+ point_mass",
        "+ gain_error",
    ]
    assert words(axis) == ["1234", "7.5", "1.04"]
    assert axis.get_yscale() == "log"


def test_a_model_that_lacks_nothing_is_a_single_point():
    axis = drawn(ledger_plots.error_falls(ledger(step(None, 0.98)))).axes[0]
    assert words(axis) == ["0.98"]
    low, high = axis.get_ylim()
    assert low < 0.98 < 1 < high


def test_a_misfit_of_zero_is_drawn_on_the_logarithmic_axis():
    axis = drawn(ledger_plots.error_falls(ledger(step(None, 12.0), step("mass", 0.0)))).axes[0]
    assert words(axis) == ["12", "0"]
    low, _ = axis.get_ylim()
    assert 0 < low < line(axis, "misfit of the best fit")[1] < 0.01


def test_of_many_sensors_the_worst_three_are_drawn():
    names = [f"s{number}" for number in range(1, 9)]
    many = {
        name: xr.concat([dataset] * 4, "sensor").assign_coords(sensor=names)
        for name, dataset in fits().items()
    }
    worst = xr.DataArray([1.0, 3.0, 1.0, 1.0, 1.0, 4.0, 1.0, 2.0], {"sensor": names})
    many["as given"]["error"] = many["as given"]["noise"] * worst
    pages = ledger_plots.before_and_after_pages(many)
    assert [len(page.axes) for page in pages] == [2, 2, 2]
    assert [page.axes[0].get_title() for page in pages] == [
        f"sensor {name}, actuator a1" for name in ("s6", "s2", "s8")
    ]


def test_responses_and_errors_are_those_of_each_fit():
    datasets = fits()
    figure = ledger_plots.before_and_after(datasets)
    assert len(figure.axes) == 4
    for sensor in range(2):
        upper, lower = figure.axes[2 * sensor : 2 * sensor + 2]
        for name, dataset in datasets.items():
            channel = dataset.isel(sensor=sensor, actuator=0)
            np.testing.assert_allclose(line(upper, name), 20 * channel["predicted"])
            np.testing.assert_array_equal(line(lower, f"error, {name}"), channel["error"])
            np.testing.assert_array_equal(line(lower, f"noise, {name}"), channel["noise"])
        assert len({curve.get_linestyle() for curve in lower.lines}) == len(datasets)
        assert not lower.get_title()  # it belongs to that above
        assert upper.get_title() == f"sensor s{sensor + 1}, actuator a1"
        measured = datasets["as given"]["measured"][sensor, 0]
        np.testing.assert_allclose(line(upper, "measured"), 20 * measured)
        assert upper.get_ylabel() == "magnitude\n[dB re 1 (m/s)/N]"
        assert lower.get_ylabel() == "size of error\n[(m/s)/N]"


def test_one_noise_of_all_models_is_one_entry_of_the_legend():
    shared = fit(1)["noise"]
    figure = ledger_plots.before_and_after({n: f.assign(noise=shared) for n, f in fits().items()})
    assert [label for label in labels(figure) if "noise" in label] == ["noise"]
    noises = [curve for curve in figure.axes[1].lines if curve.get_label() == "noise"]
    assert {curve.get_linestyle() for curve in noises} == {"-"}
    np.testing.assert_array_equal(noises[0].get_ydata(), shared[0, 0])


@pytest.mark.parametrize("effects", [1, 2, 6])
def test_a_legend_of_long_names_stays_within_the_figure_and_beside_the_panels(effects):
    long = f"with {' and '.join(['attached: (spring + dashpot) - mass'] * effects)}"
    datasets = {AS_DRAWN: fit(3), "as given": fit(1), long: fit(2)}
    one_pair = {name: dataset.isel(sensor=[0]) for name, dataset in datasets.items()}
    figure = drawn(ledger_plots.before_and_after(one_pair))
    legend, (upper, lower) = figure.legends[0].get_window_extent(), figure.axes
    assert 0 < legend.x0 < legend.x1 < figure.bbox.width and legend.y1 <= figure.bbox.height
    assert upper.get_tightbbox().y1 <= legend.y0
    inches = [panel.get_window_extent().height / figure.dpi for panel in (upper, lower)]
    assert min(inches) > 1.5
    assert figure.get_figheight() <= 11.0


def test_marks_at_the_edge_tell_where_the_model_as_drawn_lies_outside():
    datasets = {AS_DRAWN: fit(3), **fits()}
    drawn = datasets[AS_DRAWN]["predicted"]
    drawn[0, 0] = [-9.0, 0.5, 0.5, 9.0]
    panel = ledger_plots.before_and_after(datasets).axes[0]
    below, above = (mark for mark in panel.lines if mark.get_label() == OUTSIDE)
    assert (below.get_xdata().tolist(), below.get_ydata().tolist()) == ([10.0], [0.0])
    assert (above.get_xdata().tolist(), above.get_ydata().tolist()) == ([80.0], [1.0])
    low, high = panel.get_ylim()
    shown = np.concatenate([line(panel, name) for name in (*fits(), "measured")])
    assert low < np.nanmin(shown) and np.nanmax(shown) < high


def test_phases_stand_between_responses_and_errors_where_they_are_known():
    def with_phases(dataset):
        phase = xr.zeros_like(dataset["error"]) + np.array([170.0, -170.0, -160.0, 0.0])
        return dataset.assign(measured_phase=phase, predicted_phase=phase)

    figure = ledger_plots.before_and_after({n: with_phases(f) for n, f in fits().items()})
    assert len(figure.axes) == 6
    assert [axis.get_ylabel() for axis in figure.axes[1::3]] == ["phase [°]"] * 2
    predicted, _, measured = figure.axes[1].lines
    assert np.isnan(predicted.get_ydata()[1])  # no line across the whole axis
    np.testing.assert_array_equal(measured.get_ydata()[:2], [170.0, -170.0])
    assert measured.get_zorder() < predicted.get_zorder()  # dots do not cover the curves


def test_each_force_level_has_panels_of_its_own():
    figure = ledger_plots.before_and_after(fits(levels=2))
    assert len(figure.axes) == 8
    assert figure.axes[1].get_title() == "sensor s1, actuator a1, 2 N"
    expected = fits(levels=2)["as given"]["predicted"][0, 0, 1]
    np.testing.assert_allclose(line(figure.axes[1], "as given"), 20 * expected)


def test_logarithms_differ_by_the_logarithm_of_a_ratio():
    axis = ledger_plots.before_and_after(fits(parts=False)).axes[1]
    assert axis.get_ylabel() == "size of error\n[log10 of ratio]"


def test_a_ledger_marks_where_its_effects_were_found():
    added = EXPERIMENT + bp.effects.point_mass(0.37, 0.2)
    figure = ledger_plots.suspicion(replace(ledger(), experiment=added))
    (star,) = figure.axes[0].lines
    assert (list(star.get_xdata()), list(star.get_ydata())) == ([0.37], [3])


def test_what_a_ledger_claims_comes_first_whatever_else_is_suspect():
    claimed = replace(ledger(), verdict=("gain_error",))
    ranked = ledger_plots.suspicion(claimed).axes[1]
    bars = {round(bar.get_y() + 0.4): bar for bar in ranked.patches}
    green = [bars[n].get_facecolor() == to_rgba(ledger_plots.CLAIMED) for n in range(4)]
    assert green == [False, False, False, True]
    assert bars[3].get_width() < bars[2].get_width()
    kinds = [
        label.get_text() for label in ledger_plots.suspicion(claimed).axes[0].get_yticklabels()
    ]
    assert kinds[-1] == "gain_error"


FLANGE = "at the upper flange of the beam"


def many_kinds(table, count=45):
    """Scores of many kinds, each about a part with a long name."""
    return pd.concat(
        [
            table.assign(kind=f"kind_{number}", setting=f"sensor s{number}+x, {FLANGE}")
            for number in range(count)
        ]
    )


@pytest.mark.parametrize(
    "draw",
    [
        lambda: ledger_plots.suspicion(ranking(many_kinds(scores()))),
        lambda: ledger_plots.suspicion(ranking(many_kinds(scores_in_space()))),
        lambda: ledger_plots.probabilities(
            Ranking((), {f"kind_{n}": 0.02 for n in range(45)}, (), scores(), ())
        ),
    ],
    ids=["on a line", "in space", "probabilities"],
)
def test_many_kinds_of_effects_are_no_higher_than_a_page(draw):
    figure = draw()
    figure.savefig(io.BytesIO())
    assert figure.get_figheight() <= 11.0
    assert_names_of_bars_stand_apart(figure, 45)


@pytest.mark.parametrize("count", [9, 15])
def test_names_of_some_kinds_stand_apart_below_wide_maps(count):
    table = many_kinds(scores_in_space(), count)
    table[["y", "z"]] *= 0.05
    figure = ledger_plots.suspicion(ranking(table))
    figure.savefig(io.BytesIO())
    names = assert_names_of_bars_stand_apart(figure, count)
    assert all(name.get_text().endswith("beam" if count == 9 else "…") for name in names)


def test_long_names_of_bars_leave_maps_their_room():
    table = scores_in_space(flat=True)
    widths = []
    for setting in ("", f"sensor s1+x, {FLANGE}"):
        figure = drawn(ledger_plots.suspicion(ranking(table.assign(setting=setting))))
        widths.append(maps(figure)[0].get_window_extent().width)
    assert widths[0] == pytest.approx(widths[1])


def assert_names_of_bars_stand_apart(figure, count):
    bars = next(axis for axis in reversed(figure.axes) if len(axis.get_yticklabels()) == count)
    names = sorted(bars.get_yticklabels(), key=lambda name: name.get_position()[1])
    extents = [name.get_window_extent() for name in names]
    assert all(low.y1 < high.y0 for low, high in itertools.pairwise(extents))
    return names


def test_numbers_of_a_misfit_that_falls_by_decades_stand_within_their_panel():
    figure = Figure(figsize=(6, 3))
    panel = figure.add_subplot()
    misfit = Falling([1.8e6, 153.0], "reduced chi-square [1]")
    draw_falling(panel, ["as given", "+ mass"], misfit, "black", top=2.0, beside=0.5)
    FigureCanvasAgg(figure).draw()
    first, *_ = panel.texts
    assert first.get_window_extent().y1 < panel.get_window_extent().y1
