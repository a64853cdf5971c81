"""What `bayes-placement check`, `explain` and `improve` tell, write and refuse."""

import dataclasses
import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import bayes_placement as bp
from bayes_placement.cli.app import app
from bayes_placement.criticism.missing import _shared_fits
from bayes_placement.plots import ledger as ledger_plots

MODEL = """
import jax
import numpy as np
import numpyro.distributions as dist
import bayes_placement as bp

modes = bp.beams.bar(
    5, length=1.0, area=1e-3, youngs_modulus=dist.Uniform(0.95e9, 1.05e9), density=9000.0
)
experiment = bp.Experiment(
    bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.02, 0.06))),
    sensors=[bp.Sensor("s1", at=bp.positions.Segment(0.2, within=0.01)), bp.Sensor("s2", at=0.6)],
    actuators=[bp.Actuator("a1", at=0.3)],
    frequency=np.arange(100.0, 700.0, 30.0),
    observe=bp.observe.Complex("velocity"),
    noise=bp.noise.Gaussian(2e-5),
)
"""
HIDDEN = """
hidden = experiment + bp.effects.point_mass(0.42, 0.3)
"""
NOTHING = """
hidden = experiment
"""
MEASUREMENT = """
exact = np.asarray(jax.jit(lambda: hidden.nominal().frf())())
real, imaginary = 2e-5 * np.random.default_rng(5).standard_normal((2, *exact.shape))
measurement = bp.Measurement.from_arrays(
    exact + real + 1j * imaginary,
    experiment.frequency,
    sensors=["s1", "s2"],
    actuators=["a1"],
    quantity="mobility",
    positions={"s1": (0.2, 0.0, 0.0), "s2": (0.6, 0.0, 0.0), "a1": (0.3, 0.0, 0.0)},
)
"""
COMMANDS = {
    "check": (),
    "explain": ("--effects", "point_mass"),
    "improve": ("--effects", "point_mass, time_delay"),
}


def run(*words, caches=None):
    environment = {} if caches is None else {"XDG_CACHE_HOME": str(caches)}
    return CliRunner().invoke(app, [*map(str, words)], env=environment)


def written(folder, *text):
    path = folder / "study.py"
    path.write_text("".join(text))
    return path


@pytest.fixture(scope="module")
def hidden(tmp_path_factory):
    """Run all three on a model that lacks a mass: the folder, and what each said."""
    folder = tmp_path_factory.mktemp("hidden")
    model = written(folder, MODEL, HIDDEN, MEASUREMENT)
    output = {}
    for command, options in COMMANDS.items():
        caches = folder / f"caches of {command}"
        done = run(command, model, *options, "--out", folder / command, caches=caches)
        assert done.exit_code == (command == "check"), (done.output, done.exception)
        output[command] = done.output
    return folder, output


FILES = {
    "check": [
        "discrepancy.png",
        "findings.nc",
        "measured_against_band.png",
        "misfit.csv",
        "misfit.txt",
        "residual_map.png",
        "run.json",
    ],
    "explain": [
        "explanation.csv",
        "explanation.json",
        "explanation.txt",
        "findings.nc",
        "probabilities.png",
        "run.json",
        "suspicion.csv",
        "suspicion.png",
    ],
    "improve": [
        "before_and_after.png",
        "compared.csv",
        "error_falls.png",
        "findings.nc",
        "ledger.json",
        "ledger.txt",
        "probabilities.png",
        "residual_map.png",
        "run.json",
        "suspicion.csv",
        "suspicion.png",
    ],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_run_writes_tables_and_figures(hidden, command):
    folder = hidden[0] / command
    assert sorted(path.name for path in folder.iterdir()) == FILES[command]
    for path in folder.glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("command", COMMANDS)
def test_a_run_shows_the_priors_its_progress_and_where_the_results_are(hidden, command):
    output = hidden[1][command]
    for piece in ("Uniform(9.5e+08, 1.05e+09)", "100 %", "took"):
        assert piece in output
    assert output.splitlines()[-1] == f"Results are in {hidden[0] / command}/"


def again(earlier, folder, command, tmp_path, *options):
    """A run with what an earlier one kept."""
    shutil.copytree(folder / f"caches of {earlier}", tmp_path / "caches")
    _shared_fits._LAST.clear()
    words = (command, folder / "study.py", *(options or COMMANDS[command]))
    return run(*words, "--out", tmp_path / "again", caches=tmp_path / "caches")


KEPT = "Found by an earlier run with the same model, data and options"


def test_a_run_of_the_same_question_takes_the_answer_that_is_there(hidden, tmp_path):
    folder, output = hidden
    done = again("improve", folder, "improve", tmp_path)
    assert KEPT in done.output
    assert KEPT not in output["improve"]
    first, second = folder / "improve", tmp_path / "again"
    assert sorted(path.name for path in second.iterdir()) == FILES["improve"]
    for name in {*FILES["improve"]} - {"run.json", "ledger.json"}:
        assert (first / name).read_bytes() == (second / name).read_bytes(), name
    ledgers = [json.loads((out / "ledger.json").read_text()) for out in (first, second)]
    assert all(ledger.pop("record") for ledger in ledgers)
    assert ledgers[0] == ledgers[1]
    files = [
        json.loads((out / "run.json").read_text())["improve"]["files"] for out in (first, second)
    ]
    assert sorted(files[0]) == sorted(files[1])


def test_no_picture_that_failed_is_named_and_the_answer_is_kept_all_the_same(
    hidden, tmp_path, monkeypatch
):
    def fails(*_, **__):
        raise IndexError("too many indices")

    folder, output = hidden
    monkeypatch.setattr(ledger_plots, "suspicion", fails)
    options = *COMMANDS["improve"], "--traceback", "--report"  # with a report all is drawn anew
    done = again("improve", folder, "improve", tmp_path, *options)
    assert done.exit_code == 0 and KEPT in done.output
    assert "A figure was not drawn (IndexError: too many indices)" in done.output
    assert "in fails\n" in done.output
    assert "before_and_after.png" in done.output
    assert "suspicion.png" in output["improve"] and "suspicion.png" not in done.output


@pytest.mark.long
def test_another_question_takes_the_fits_that_are_there(hidden, tmp_path):
    folder, output = hidden
    done = again("improve", folder, "improve", tmp_path, "--effects", "point_mass")
    counts = re.search(
        r"Fits and scans of an earlier run that are used again: (\d+) of (.*)", done.output
    )
    assert counts and int(counts[1]) > 0 and f"{tmp_path}/caches/bayes_placement/fits-" in counts[2]
    assert "of an earlier run" not in output["improve"]
    assert KEPT not in done.output
    assert "time_delay" not in (tmp_path / "again" / "compared.csv").read_text()


def test_check_takes_the_fit_of_improve(hidden, tmp_path):
    folder, _ = hidden
    done = again("improve", folder, "check", tmp_path)
    assert "Fits and scans of an earlier run that are used again: 1 of" in done.output
    first, second = (
        (out / "misfit.csv").read_text() for out in (folder / "check", tmp_path / "again")
    )
    assert first == second


@pytest.mark.long
def test_explain_takes_the_fit_of_check(hidden, tmp_path):
    folder, _ = hidden
    done = again("check", folder, "explain", tmp_path)
    assert "Fits and scans of an earlier run that are used again: 1 of" in done.output


@pytest.mark.long
def test_the_search_that_a_model_declares_is_that_of_its_check(tmp_path):
    model = written(tmp_path, MODEL, HIDDEN, MEASUREMENT, "engine = bp.engines.MAP(starts=2)\n")
    done = run("check", model, "--out", tmp_path / "out", caches=tmp_path / "caches")
    (of_data,) = tmp_path.glob("caches/*/fits-*/*")  # what the checks of the data said
    assert "content" in np.load(of_data), done.output


def test_check_says_where_the_model_fails(hidden):
    folder, output = hidden
    table = pd.read_csv(folder / "check" / "misfit.csv", index_col=0)
    assert {"all data", "sensor s1+x", "sensor s2+x"} <= set(table.index)
    assert table.loc["all data", "reduced chi-square"] > 3
    assert all(kind.kind in "if" for kind in table.dtypes)  # numbers, none of them as words
    text = (folder / "check" / "misfit.txt").read_text()
    for where in (output["check"], text):
        assert "The model fails: reduced chi-square is" in where


def test_explain_names_the_effect_and_its_probability(hidden):
    folder, output = hidden
    table = pd.read_csv(folder / "explain" / "explanation.csv", index_col=0)
    assert table.index[0] == "point_mass"
    assert table.loc["point_mass", "probability"] > 0.99
    for where in (output["explain"], (folder / "explain" / "explanation.txt").read_text()):
        assert "Missing is point_mass, 0." in where


def test_check_and_explain_say_the_next_command(hidden):
    folder, output = hidden
    model = folder / "study.py"
    assert f"\nWhat is missing: bayes-placement explain {model}\n" in output["check"]
    words = "--effects point_mass"
    following = f"How far the error falls with it: bayes-placement improve {model} {words}"
    assert following in output["explain"]


def test_the_suspicion_is_written_place_by_place(hidden):
    scores = pd.read_csv(hidden[0] / "explain" / "suspicion.csv")
    masses = scores[scores["kind"] == "point_mass"]
    assert len(masses) > 20
    worst = masses.loc[masses["score"].abs().idxmax(), "at"]
    assert worst == pytest.approx(0.42, abs=0.1)
    assert set(scores["kind"]) == {"point_mass"}


@pytest.mark.long
def test_warnings_of_the_inference_are_lines_of_the_report(hidden, tmp_path, monkeypatch):
    class Doubtful(bp.engines.Importance):
        def run(self, posterior, key, progress):
            draws = super().run(posterior, key, progress)
            return dataclasses.replace(draws, warnings=("Look twice.",))

    monkeypatch.setattr(bp.engines, "MAP", lambda **settings: Doubtful(draws=50))
    model = written(tmp_path, MODEL, HIDDEN, MEASUREMENT, "engine = None\n")
    done = run("check", model, "--out", tmp_path)
    assert done.exit_code == 1, (done.output, done.exception)
    for where in (done.output, (tmp_path / "misfit.txt").read_text()):
        assert "- Look twice." in where


def test_improve_writes_the_ledger(hidden):
    folder, output = hidden
    ledger = json.loads((folder / "improve" / "ledger.json").read_text())
    assert set(ledger) == {
        "schema",
        "effects",
        "reach",
        "steps",
        "baseline",
        "verdict",
        "probabilities",
        "confounded",
        "cautions",
        "policy",
        "table",
        "unexplained",
        "wall_seconds",
        "record",
    }
    first, last = ledger["steps"]
    assert (first["added"], last["added"]) == (None, "point_mass")
    for step in (first, last):
        assert {"added", "parameters", "chi2_per_datum", "log_evidence"} <= set(step)
    assert first["chi2_per_datum"] > 3 > 1.3 > last["chi2_per_datum"]
    assert ledger["verdict"] == ["point_mass"]
    (claim,) = ledger["effects"]
    assert (claim["name"], claim["acts_on"], claim["law_tree"]) == (
        "point_mass",
        "displacement",
        "m",
    )
    assert ledger["probabilities"].keys() == {
        "point_mass",
        "time_delay",
        "nothing_missing",
        "none_of_these",
    }
    assert ledger["unexplained"] is False
    low, high = last["parameters"]["structure.effects.point_mass.at"]["interval_99"]
    assert low < 0.42 < high
    for where in (output["improve"], (folder / "improve" / "ledger.txt").read_text()):
        assert "Missing: point_mass, 0." in where


def test_improve_of_a_right_model_claims_nothing(tmp_path):
    model = written(tmp_path, MODEL, NOTHING, MEASUREMENT)
    done = run("improve", model, "--effects", "time_delay", "--out", tmp_path)
    assert done.exit_code == 0, done.output
    ledger = json.loads((tmp_path / "ledger.json").read_text())
    assert ledger["verdict"] == []
    assert len(ledger["steps"]) == 1
    assert "Nothing is claimed to be missing" in done.output
    assert (tmp_path / "before_and_after.png").is_file()


def refused(*words, code=2):
    done = run(*words)
    assert done.exit_code == code, done.output
    assert "Traceback" not in done.output
    return " ".join(done.output.replace("│", " ").split())


@pytest.mark.parametrize("command", COMMANDS)
def test_a_model_without_data_asks_for_them(tmp_path, command):
    model = written(tmp_path, MODEL)
    message = refused(command, model, "--out", tmp_path / "out")
    assert "declares no `measurement`" in message
    assert f"bayes-placement {command} {model} --data measured.uff" in message
    assert not (tmp_path / "out").exists()


def test_data_from_a_file_take_the_place_of_the_models_own(hidden, tmp_path):
    measurement = bp.io.model.read(hidden[0] / "study.py").measurement
    bp.io.uff.write(tmp_path / "fewer.uff", measurement.lines(measurement.frequency[1:]))
    words = (hidden[0] / "study.py", "--data", tmp_path / "fewer.uff", "--out", tmp_path)
    assert "100" in refused("check", *words, code=3)


@pytest.mark.parametrize("command", ["explain", "improve"])
def test_an_unknown_effect_is_answered_with_the_known_ones(hidden, command, tmp_path):
    words = (hidden[0] / "study.py", "--effects", "point_mas", "--out", tmp_path)
    message = refused(command, *words)
    assert "Did you mean 'point_mass'?" in message
    assert "The effects are point_mass, " in message
    assert message.endswith("--effects point_mass, or no --effects for those tried by default.")
    assert "library(" not in message  # the command line knows no Python


def test_the_line_that_mends_wrong_names_of_effects_has_the_right_ones_as_well(hidden, tmp_path):
    study = hidden[0] / "study.py"
    words = (study, "--effects", "time_delay,rust,point_mas", "--out", tmp_path)
    message = refused("improve", *words)
    assert "There is no effect 'rust'. The effects are" in message
    assert message.endswith(
        "--effects time_delay,point_mass, or no --effects for those tried by default."
    )
    message = refused("improve", study, "--effects", "rust", "--out", tmp_path)
    assert message.endswith("with commas: no --effects for those tried by default.")


def test_effects_that_cannot_act_are_answered_with_those_that_can(hidden, tmp_path):
    words = (hidden[0] / "study.py", "--effects", "cubic_stiffness", "--out", tmp_path)
    message = refused("improve", *words)
    assert "--effects cubic_stiffness was given; none of these can act" in message
    assert "Those that can: point_mass, " in message
    assert "cubic_stiffness" not in message.partition("Those that can")[2]


def test_a_folder_without_a_case_is_refused(tmp_path):
    assert "case.json" in refused("check", tmp_path, "--out", tmp_path / "out")


def test_a_folder_is_read_as_a_case(shared_data, tmp_path):
    case = tmp_path / "case"
    shutil.copytree(shared_data / "cases" / "03_cantilever-01", case)
    (case / "measured.uff").unlink()
    assert "measured.uff" in refused("improve", case, "--out", tmp_path / "out")


def test_an_unknown_engine_is_answered_with_the_known_ones(hidden):
    message = refused("check", hidden[0] / "study.py", "--engine", "guess")
    assert "'guess' is not one of" in message
    assert "nuts" in message


def test_commands_say_which_lines_they_take_and_what_the_data_checks_say(hidden):
    for output in hidden[1].values():
        assert "Lines: all 20 of the experiment, from 100 to 670 Hz." in output
        assert (
            "- No fault was found in the data (checked: repeated records, overload, mistaken "
            "records, natural frequencies, units, phase)." in output
        )


REPEATED = """
import dataclasses
measurement = dataclasses.replace(measurement, frf=measurement.frf[[0, 0]])
"""


@pytest.mark.long
def test_faults_of_the_data_are_told_once_before_any_work(tmp_path):
    model = written(tmp_path, MODEL, HIDDEN, MEASUREMENT, REPEATED)
    done = run("check", model, "--out", tmp_path / "out", "--lines", 12)
    assert done.exit_code == 1, (done.output, done.exception)
    sentence = "s1 / a1 and s2 / a1 hold the same record to six digits"
    assert done.output.count("hold the same record to six digits") == 1
    assert done.output.index("hold the same record") < done.output.index("chi-square")
    assert "hold the same record" in (tmp_path / "out" / "misfit.txt").read_text(), sentence
    assert "Lines: 12 of 20, from" in done.output
    assert "dense where the FRFs change most against their noise, since --lines 12" in done.output
    assert "12 lines from" in done.output  # as the table of the experiment says


MISTAKEN = """
import dataclasses
measurement = dataclasses.replace(measurement, {})
"""


def test_lines_in_radians_a_second_are_told_where_none_was_measured(tmp_path):
    radians = MISTAKEN.format("frequency=2 * np.pi * measurement.frequency")
    model = written(tmp_path, MODEL, NOTHING, MEASUREMENT, radians)
    message = refused("check", model, "--out", tmp_path / "out", code=3)
    assert "look to have lines in rad/s that were taken for Hz" in message
    assert message.index("in rad/s") < message.index("of the frequencies given were not measured")


@pytest.mark.long
@pytest.mark.parametrize("command", ["improve", pytest.param("explain", marks=pytest.mark.longest)])
def test_mistaken_records_are_told_before_any_search(tmp_path, command):
    inverted = MISTAKEN.format("frf=1 / measurement.frf")
    model = written(tmp_path, MODEL, NOTHING, MEASUREMENT, inverted)
    done = run(command, model, "--effects", "point_mass", "--out", tmp_path / "out")
    first = done.output.index("look inverted, as of force and response that were swapped")
    assert first < done.output.index(f"{command}: ")


@pytest.mark.long
@pytest.mark.longest
def test_lines_of_a_large_measurement_are_thinned_and_the_reason_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("bayes_placement.cli._inputs.MOST_VALUES", 31)
    model = written(tmp_path, MODEL, HIDDEN, MEASUREMENT)
    done = run("check", model, "--out", tmp_path / "out")
    assert done.exit_code == 1, (done.output, done.exception)
    assert "Lines: 15 of 20, from" in done.output
    assert "since 40 values take long (--lines 20 takes all)." in done.output


@pytest.mark.long
@pytest.mark.longest
def test_a_model_error_can_be_declared_for_a_command(tmp_path):
    folder = tmp_path / "declared"
    (tmp_path / "model.py").write_text(MODEL + NOTHING + MEASUREMENT)
    result = run("check", tmp_path / "model.py", "--model-error", "--out", folder)
    assert result.exit_code == 0, result.output
    assert "model_error.frequency.size" in result.output
    assert "The model errs: natural frequencies by" in (folder / "misfit.txt").read_text()
