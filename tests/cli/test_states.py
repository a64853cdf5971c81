"""`explain` and `improve` of a structure that was measured in more than one state."""

import pytest

from tests.cli.test_criticism import MEASUREMENT, MODEL, run, written

EARLIER = """
baseline = measurement
hidden = experiment + bp.effects.point_mass(0.42, 0.3)
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A model file with a mass that its baseline did not have."""
    before = "hidden = experiment\n"
    return written(
        tmp_path_factory.mktemp("states"), MODEL, before, MEASUREMENT, EARLIER, MEASUREMENT
    )


def test_explain_says_what_is_new_since_the_baseline(model, tmp_path):
    done = run("explain", model, "--effects", "point_mass", "--out", tmp_path)
    assert done.exit_code == 0, (done.output, done.exception)
    said = " ".join(done.output.split())
    assert "An earlier state was measured too" in said
    assert "New since the baseline is point_mass" in said


def test_explain_leaves_the_earlier_state_out(model, tmp_path):
    done = run("explain", model, "--effects", "point_mass", "--alone", "--out", tmp_path)
    assert done.exit_code == 0, (done.output, done.exception)
    said = " ".join(done.output.split())
    assert "Missing is point_mass" in said
    assert "baseline" not in said
