"""What `bayes-placement place` tells, writes and refuses."""

from types import SimpleNamespace

import numpy as np
import numpyro.distributions as dist
import pandas as pd
import pytest
import xarray as xr
from typer.testing import CliRunner

import bayes_placement as bp
from bayes_placement._shared.progress import no_progress
from bayes_placement.cli import place as placing
from bayes_placement.cli.app import app
from bayes_placement.cli.place import positions_to_try, with_sensors
from bayes_placement.design import _candidates
from models import bar
from tests.effects import models_in_space

MODEL = """
import numpy as np
import numpyro.distributions as dist
import bayes_placement as bp

modes = bp.beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
experiment = bp.Experiment(
    bp.Structure(modes, damping=bp.damping.Modal([{ratio}])),
    sensors=[bp.Sensor("s1", at=bp.positions.Segment(0.25, within=0.04)){more}],
    actuators=[bp.Actuator("a1", at=0.3)],
    frequency={lines},
    observe=bp.observe.LogAmplitude("velocity"),
    noise=bp.noise.{noise},
)
"""
PLAIN = {
    "ratio": "dist.Uniform(0.02, 0.06)",
    "more": "",
    "lines": "[150.0, 166.0]",
    "noise": "Gaussian(0.05)",
}
MEASUREMENT = """
measurement = experiment.nominal_measurement()
engine = bp.engines.Importance(draws={draws})
"""
TWO = ', bp.Sensor("s2", at=bp.positions.Segment(0.5, within=0.04))'


def run(*words):
    return CliRunner().invoke(app, ["place", *map(str, words), "--places", "4"])


def written(folder, *additions, **changes):
    path = folder / "study.py"
    path.write_text(MODEL.format_map(PLAIN | changes) + "".join(additions))
    return path


def done(folder, *words, out="out"):
    """Run a command that ends well: what it said, and its folder."""
    answer = run(folder / "study.py", *words, "--out", folder / out)
    assert answer.exit_code == 0, (answer.output, answer.exception)
    return answer.output, folder / out


def refused(*words, codes=(2,)):
    answer = run(*words)
    assert answer.exit_code in codes, (answer.output, answer.exception)
    assert "Traceback" not in answer.output
    return " ".join(answer.output.replace("│", " ").split())


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """A finished run: its folder, with the model in it, and what it said."""
    folder = tmp_path_factory.mktemp("first")
    written(folder)
    return folder, done(folder)[0]


def test_a_run_writes_tables_a_map_and_figures(first):
    out = first[0] / "out"
    assert sorted(path.name for path in out.iterdir()) == [
        "chunks",
        "map.nc",
        "map.png",
        "placement.txt",
        "placements.csv",
        "placements.png",
        "run.json",
    ]
    for path in out.glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG")


def test_a_run_shows_priors_a_table_with_units_and_the_verdict(first):
    folder, output = first
    for piece in ("Uniform(0.02, 0.06)", "s1 [m]", "a1 [m]", "information [nat]", "100 %"):
        assert piece in output
    assert "lines are used" not in output
    verdict = (folder / "out" / "placement.txt").read_text().strip()
    assert verdict.startswith("Best of 12 placements: s1 at 0.")
    assert f"\n{verdict}\n" in output
    assert output.splitlines()[-1] == f"Results are in {folder / 'out'}/"


def test_table_and_map_agree_on_places_and_information(first):
    out = first[0] / "out"
    table = pd.read_csv(out / "placements.csv", index_col=0)
    with xr.open_dataset(out / "map.nc", engine="h5netcdf") as dataset:
        np.testing.assert_allclose(dataset["s1"], [0.2, 0.4, 0.6, 0.8])
        np.testing.assert_allclose(dataset["a1"], [0.2, 0.4, 0.6, 0.8])
        best = dataset["information_gain"].sel(
            s1=table["s1"][0], a1=table["a1"][0], method="nearest"
        )
        assert (
            float(best)
            == float(dataset["information_gain"].max())
            == pytest.approx(table["information_gain"].max())
        )
    assert len(table) == 12 and table["information_gain"].is_monotonic_decreasing


def test_the_terminal_shows_the_best_placements_in_order(first):
    table = pd.read_csv(first[0] / "out" / "placements.csv", index_col=0)
    rows = [line.split() for line in first[1].splitlines() if " ± " in line]
    shown = [row for row in rows if row[0].isdigit()]
    assert [int(row[0]) for row in shown] == [*range(1, 11)]
    for row, (_, known) in zip(shown, table.iterrows(), strict=False):
        assert [float(row[1]), float(row[2])] == pytest.approx([known["s1"], known["a1"]])
        assert float(row[3]) == pytest.approx(known["information_gain"], rel=1e-3)


def test_another_run_reads_what_the_first_has_computed(first):
    folder, output = first
    out = folder / "out"
    chunks = {path: path.stat().st_mtime_ns for path in (out / "chunks").iterdir()}
    table = (out / "placements.csv").read_bytes()
    again, _ = done(folder)
    assert {path: path.stat().st_mtime_ns for path in (out / "chunks").iterdir()} == chunks
    assert len(chunks) > 0 and (out / "placements.csv").read_bytes() == table
    assert [line for line in again.splitlines() if "took" not in line] == [
        line for line in output.splitlines() if "took" not in line
    ]


def test_to_ask_about_its_only_parameter_is_the_same(first):
    folder, _ = first
    chunks = sorted((folder / "out" / "chunks").iterdir())
    table = (folder / "out" / "placements.csv").read_bytes()
    done(folder, "--about", "structure.damping.ratio.1")
    assert sorted((folder / "out" / "chunks").iterdir()) == chunks
    assert (folder / "out" / "placements.csv").read_bytes() == table


@pytest.mark.long
def test_another_seed_is_computed_anew(first):
    folder, _ = first
    done(folder, "--seed", 1, out="seed")
    table, other = (
        pd.read_csv(folder / name / "placements.csv", index_col=0) for name in ("out", "seed")
    )
    assert table["information_gain"][0] != other["information_gain"][0]
    assert table["information_gain"][0] == pytest.approx(
        other["information_gain"][0], abs=5 * table["information_gain_se"][0]
    )


@pytest.mark.long
def test_more_sensors_are_like_the_last_one_and_added_one_at_a_time(first):
    output, out = done(first[0], "--sensors", 2, "--search", "forward", out="two")
    assert "2 sensor x 1 actuator" in output and "sensor.s2.position" in output
    table = pd.read_csv(out / "placements.csv", index_col=0)
    assert {"s1", "s2", "a1"} <= set(table.columns)
    # There is no map of three transducers, nor is there one to wait for.
    assert not list(out.glob("map.*"))
    assert not any(line.startswith("map ") for line in output.splitlines())


def test_fewer_sensors_are_the_first_ones(tmp_path):
    experiment = bp.io.model.read(written(tmp_path, more=TWO)).experiment
    asked = with_sensors(experiment, 1)
    assert [*asked.sensor] == ["s1"] and [*asked.actuator] == ["a1"]
    assert with_sensors(experiment, 2) is experiment
    assert with_sensors(experiment, None) is experiment


def test_the_noise_may_be_stated(first):
    _, loud = done(first[0], "--noise", 0.5, "--search", "sequential", out="loud")
    learnt = pd.read_csv(loud / "placements.csv")["information_gain"].max()
    assert not list(loud.glob("map.*"))  # not all of its cells are tried
    assert learnt < 0.5 * pd.read_csv(first[0] / "out" / "placements.csv")["information_gain"].max()


def test_of_many_lines_some_are_taken_evenly(tmp_path):
    written(tmp_path, lines="np.arange(100.0, 200.0)")
    output, _ = done(tmp_path, "--lines", 2, "--search", "sequential")
    assert "2 of 100 lines are used, evenly over the band" in output and "--lines 100" in output
    assert "2 lines from 125 to 175 Hz" in output


@pytest.mark.long
def test_data_come_first_and_then_there_is_less_to_learn(tmp_path, first):
    model = written(tmp_path, MEASUREMENT.format(draws=1000))
    measurement = bp.io.model.read(model).measurement
    bp.io.uff.write(tmp_path / "measured.uff", measurement)
    words = ("--data", tmp_path / "measured.uff", "--search", "sequential")
    output, out = done(tmp_path, *words)
    assert any(line.startswith("earlier data: ") for line in output.splitlines())
    learnt = pd.read_csv(out / "placements.csv")["information_gain"].max()
    assert learnt < 0.8 * pd.read_csv(first[0] / "out" / "placements.csv")["information_gain"].max()


def test_an_estimator_starts_from_the_posterior_of_earlier_data_and_tells_its_warnings(
    tmp_path, monkeypatch
):
    study = bp.io.model.read(written(tmp_path, MEASUREMENT.format(draws=400)))
    calls = {}

    def infer_posterior(*arguments):
        calls["arguments"] = arguments
        return xr.DataTree(xr.Dataset(attrs={"warnings": ["Look twice."]}))

    monkeypatch.setattr(placing, "infer_posterior", infer_posterior)

    def kde(*, after):
        calls["after"] = after
        return bp.information.KernelGain()

    monkeypatch.setitem(placing.ESTIMATORS, "kernel-gain", kde)
    _, warned = placing.named_estimator(
        "kernel-gain", study, study.measurement, 7, lambda: no_progress
    )
    assert warned == calls["after"].attrs["warnings"] == ["Look twice."]
    experiment, measurement, method, seed, _ = calls["arguments"]
    assert (experiment, measurement, seed) == (study.experiment, study.measurement, 7)
    assert method.engine == bp.engines.Importance(draws=400)


def explained(probability, *ratios):
    """As `improve` would return it, with explanations that differ in a mass."""

    def improve(experiment, measured, *, candidates, progress):
        known = np.linspace(0.03, 0.05, 40)
        alternatives = [
            bp.information.Alternative(
                f"mass {mass:g}",
                probability,
                experiment + bp.effects.point_mass(0.55, mass) if mass else experiment,
                {
                    "structure.damping.ratio.1": known,
                    "sensor.s1.position": np.full(40, 0.25),
                },
            )
            for mass in ratios
        ]
        return SimpleNamespace(alternatives=alternatives)

    return improve


@pytest.mark.long
def test_it_tells_explanations_of_the_data_apart(tmp_path, monkeypatch):
    written(tmp_path, MEASUREMENT.format(draws=20))
    monkeypatch.setattr(placing, "improve", explained(0.5, 0.0, 2.0))
    output, out = done(tmp_path, "--estimator", "separation", "--search", "sequential")
    learnt = pd.read_csv(out / "placements.csv")["information_gain"]
    assert 0.3 < learnt.max() < np.log(2) + 0.01
    assert any(line.startswith("earlier data: ") for line in output.splitlines())


def test_a_single_explanation_is_told_apart_from_nothing(tmp_path, monkeypatch):
    model = written(tmp_path, MEASUREMENT.format(draws=20))
    monkeypatch.setattr(placing, "improve", explained(1.0, 0.0))
    words = ("--estimator", "separation", "--out", tmp_path / "out")
    message = refused(model, *words, codes=(3,))
    assert "the data leave only one (mass 0)" in message
    assert "--estimator expected-gain" in message


def test_separation_needs_data(tmp_path):
    message = refused(written(tmp_path), "--estimator", "separation", "--out", tmp_path / "out")
    assert "declares no `measurement`" in message
    assert "place --estimator separation" in message


@pytest.mark.parametrize(
    ("changes", "words", "piece"),
    [
        ({}, ("--sensors", "0"), "at least one sensor is needed: --sensors 2"),
        ({}, ("--sensors", "9"), "would try 1e+06 placements of s1, s2"),
        ({}, ("--sensors", "40"), "would try 4.8e+24 placements of s1, s2"),
        ({"noise": "FromCoherence()"}, (), "earlier measurement of the same kind, or the"),
        ({"noise": "FromCoherence()"}, (), "--noise 0.01"),
        ({"ratio": "0.04"}, (), "the structure has no unknown parameter"),
        ({}, ("--noise", "0"), "the standard deviation must be positive"),
        ({}, ("--search", "guess"), "'guess' is not one of"),
        ({}, ("--about", "sensor.s1.position"), "names of unknown parameters are needed"),
        ({}, ("--lines", "0"), "'--lines'"),
    ],
)
def test_what_cannot_be_done_is_refused_in_words(tmp_path, changes, words, piece):
    model = written(tmp_path, **changes)
    assert piece in refused(model, *words, "--out", tmp_path / "out", codes=(2, 3))


def test_what_is_refused_leaves_no_folder(tmp_path):
    refused(written(tmp_path), "--sensors", "0", "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_folder_that_is_a_file_is_refused(tmp_path):
    model = written(tmp_path)
    assert "is a file. A folder is needed" in refused(model, "--out", model)


def on_plate(at):
    scene = models_in_space.plate()
    return bp.Experiment(
        bp.Structure(scene.modes, damping=bp.damping.Modal(dist.Uniform(0.01, 0.05))),
        sensors=[bp.Sensor("s1", at=at)],
        actuators=[bp.Actuator("a1", at=(0.1, 0.08, 0.0))],
        frequency=scene.frequency[:3],
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.Gaussian(0.02),
    )


BOX = bp.positions.Box((0.1, 0.08, 0.0), within=(0.01, 0.01, 0.0))


@pytest.mark.long
def test_places_in_space_are_nodes_far_apart_where_the_structure_moves():
    experiment = on_plate(BOX)
    places = positions_to_try(experiment, "exhaustive", 4)
    assert [*places] == ["s1", "a1"] and places["s1"] == places["a1"]
    # The plate is held at all edges: of the nodes within, the first two are opposite corners.
    nodes = models_in_space.plate().matrices.position
    at_edge = np.isin(nodes[:, 0], [0.0, 0.4]) | np.isin(nodes[:, 1], nodes[:, 1][[0, -1]])
    within = nodes[~at_edge]
    for at in places["s1"]:
        assert np.abs(within - at).max(axis=1).min() < 1e-9
    low, high = within.min(axis=0), within.max(axis=0)
    apart = np.abs(np.subtract(*places["s1"][:2]))
    np.testing.assert_allclose(apart, high - low, atol=1e-9)
    learnt = bp.place(experiment, {"s1": places["s1"]}, estimator=bp.information.KernelGain(64, 32))
    assert np.isfinite(learnt.table["information_gain"]).all()


def test_feet_of_a_frame_are_no_places():
    scene = models_in_space.frame()
    experiment = bp.Experiment(
        scene.structure(),
        sensors=[bp.Sensor("s1", at=tuple(scene.place), directions=(2,))],
        actuators=[bp.Actuator("a1", at=tuple(scene.place), directions=(2,))],
        frequency=scene.frequency,
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.Gaussian(0.02),
    )
    places = _candidates.positions_on(experiment, 100)
    assert len(places) == len(scene.matrices.position) - 2
    for foot in models_in_space.FEET.values():
        assert np.linalg.norm(np.subtract(places, foot), axis=1).min() > 0.05


def test_no_more_places_than_nodes():
    points = np.eye(3)
    places = _candidates.far_apart(points, 9)
    assert sorted(map(tuple, places)) == sorted(map(tuple, points))


def test_evolution_has_no_line_to_move_along_in_space():
    with pytest.raises(ValueError, match=r"structure lies in space\. Give --search sequential"):
        positions_to_try(on_plate(BOX), "evolutionary", 4)


def test_a_transducer_that_sits_nowhere_is_named(monkeypatch):
    monkeypatch.setattr(placing, "positions_on", lambda *arguments: [1.2, -0.3])
    experiment = bar.placed(0.3, 0.4, None)
    with pytest.raises(ValueError, match='At none of 2 positions "s1" can be mounted'):
        positions_to_try(experiment, "exhaustive", 4)


def test_places_on_a_line_leave_out_its_ends():
    places = positions_to_try(bar.placed(0.3, 0.4, None), "exhaustive", 3)
    np.testing.assert_allclose(places["s1"], [0.25, 0.5, 0.75])


@pytest.mark.long
def test_rules_of_a_placement_are_options(tmp_path):
    written(tmp_path, more=TWO)
    words = ("--forbidden", "0.15:0.25", "--least-distance", "0.3", "--cost", "s2=50")
    output, out = done(tmp_path, *words)
    table = pd.read_csv(out / "placements.csv", index_col=0)
    assert set(np.round(np.r_[table["s1"], table["a1"]], 6)) <= {0.4, 0.6, 0.8}
    together = table.dropna(subset=["s2"])
    assert (np.abs(together["s1"] - together["s2"]) > 0.29).all()
    assert "s2 is left out: its information gain is less than its cost." in output


def test_no_two_instruments_share_a_point(first):
    table = pd.read_csv(first[0] / "out" / "placements.csv", index_col=0)
    assert (np.abs(table["s1"] - table["a1"]) > 0.1).all()


@pytest.mark.parametrize(
    ("words", "piece"),
    [
        (("--forbidden", "0.4"), "--forbidden '0.4' was given; the least and the greatest"),
        (("--forbidden", "0,0:1,1"), "--forbidden '0,0:1,1' was given"),
        (("--cost", "s1"), "--cost 's1' was given; a transducer and the information"),
        (("--cost", "s1=-1"), "--cost 's1=-1' was given"),
    ],
)
def test_rules_that_are_none_are_refused(tmp_path, words, piece):
    assert piece in refused(written(tmp_path), *words, "--out", tmp_path / "out")
