"""`explain` and `improve` of a structure that was measured in more than one state."""

import json

import pytest

import bayes_placement as bp
from bayes_placement.io import model as model_files
from tests.cli.test_criticism import MEASUREMENT, MODEL, run, written

EARLIER = """
baseline = measurement
hidden = experiment + bp.effects.point_mass(0.42, 0.3)
"""


STATES = """
states = {"bare": baseline, "10 nuts": measurement}
hidden = experiment + bp.effects.point_mass(0.42, 0.6)
"""
LAST = """
states["20 nuts"] = measurement
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A model file with a mass that its baseline did not have."""
    before = "hidden = experiment\n"
    return written(
        tmp_path_factory.mktemp("states"), MODEL, before, MEASUREMENT, EARLIER, MEASUREMENT
    )


@pytest.mark.long
@pytest.mark.longest
def test_explain_says_what_is_new_since_the_baseline(model, tmp_path):
    done = run("explain", model, "--effects", "point_mass", "--out", tmp_path)
    assert done.exit_code == 0, (done.output, done.exception)
    output = " ".join(done.output.split())
    assert "An earlier state was measured too" in output
    assert "New since the baseline is point_mass" in output


def test_explain_leaves_the_earlier_state_out(model, tmp_path):
    done = run("explain", model, "--effects", "point_mass", "--alone", "--out", tmp_path)
    assert done.exit_code == 0, (done.output, done.exception)
    output = " ".join(done.output.split())
    assert "Missing is point_mass" in output
    assert "baseline" not in output


@pytest.fixture(scope="module")
def of_states(tmp_path_factory):
    """What `improve` says and writes about a model file with three states."""
    folder = tmp_path_factory.mktemp("of_states")
    text = (
        MODEL,
        "hidden = experiment\n",
        MEASUREMENT,
        EARLIER,
        MEASUREMENT,
        STATES,
        MEASUREMENT,
        LAST,
    )
    study = written(folder, *text)
    done = run("improve", study, "--effects", "point_mass", "--out", folder / "results")
    assert done.exit_code == 0, (done.output, done.exception)
    return folder, " ".join(done.output.split())


@pytest.mark.long
def test_improve_says_what_is_new_in_each_state(of_states):
    folder, output = of_states
    assert '"bare" is the baseline.' in output
    assert '"10 nuts": since "bare" point_mass is new' in output
    assert '"20 nuts": since "10 nuts" point_mass is another: mass 0.6' in output
    content = json.loads((folder / "results" / "states.json").read_text())
    assert [state["new"] for state in content["states"]] == [["point_mass"], ["point_mass"]]


@pytest.mark.long
def test_each_state_has_its_ledger_and_figures(of_states):
    results = of_states[0] / "results"
    assert sorted(path.name for path in results.iterdir()) == [
        "run.json",
        "state_1",
        "state_2",
        "states.csv",
        "states.json",
        "states.txt",
    ]
    for number in (1, 2):
        names = {path.name for path in (results / f"state_{number}").iterdir()}
        assert {"ledger.json", "ledger.txt", "error_falls.png", "before_and_after.png"} <= names


@pytest.mark.long
@pytest.mark.longest
def test_states_may_be_given_as_files(of_states, tmp_path):
    states = model_files.read(of_states[0] / "study.py").states
    files = []
    for number, label in enumerate(("bare", "20 nuts")):
        bp.io.uff.write(tmp_path / f"{number}.uff", states[label])
        files += ["--state", f"{label}={tmp_path / f'{number}.uff'}"]
    alone = written(tmp_path, MODEL)
    done = run("improve", alone, *files, "--effects", "point_mass", "--out", tmp_path / "results")
    assert done.exit_code == 0, (done.output, done.exception)
    output = " ".join(done.output.split())
    assert '"20 nuts": since "bare" point_mass is new (at 4' in output
    assert "mass 0.6" in output


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--state", "bare"], "--state 'bare' was given; a label and a file are needed"),
        (["--state", "a\x1b=x.uff"], r"--state 'a\x1b=x.uff' was given; a label and a file are"),
        (["--state", "a=x.uff", "--state", "a=y.uff"], "--state 'a=x.uff' was given; a label and"),
        (["--state", "a=x.uff", "--alone"], "--state was given beside --data, --baseline or"),
    ],
)
def test_states_that_are_none_are_refused(model, tmp_path, options, words):
    done = run("improve", model, *options, "--out", tmp_path / "results")
    assert done.exit_code == 2
    assert words in " ".join(done.output.split())
