"""What an earlier run found is believed where nothing has changed of what it follows from."""

import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from bayes_placement.cli import _run
from bayes_placement.cli._run import KeptAnswer
from bayes_placement.io import model

MODEL = """
import jax.numpy as jnp
import bayes_placement as bp
from own_law import stiffness

experiment = bp.Experiment(
    bp.Structure(bp.beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9e3),
                 damping=bp.damping.Modal(0.02)),
    sensors=[bp.Sensor("s1", at=0.2)],
    actuators=[bp.Actuator("a1", at=0.3)],
    frequency=jnp.arange(100.0, 200.0, 50.0),
    observe=bp.observe.Complex("velocity"),
    noise=bp.noise.Gaussian(NOISE),
)
"""
LAW = "def stiffness(omega):\n    return SLOPE * omega\n"


def kept_for(folder, noise="2e-5", slope="1.0", question="explain"):
    """What is kept of a question on a model, whose module says how stiff something is."""
    (folder / "own_law.py").write_text(LAW.replace("SLOPE", slope))
    path = folder / "study.py"
    path.write_text(MODEL.replace("NOISE", noise))
    return KeptAnswer(folder / "fits", question, model.read(path).experiment)


@pytest.mark.parametrize(
    "changed", [{"noise": "3e-5"}, {"slope": "2.0"}, {"question": "improve"}, {}], ids=str
)
def test_what_follows_from_anything_else_is_found_anew(tmp_path, changed):
    found = {"law": "mass", "at": np.array([0.25])}
    assert kept_for(tmp_path).read() is None
    kept_for(tmp_path).write(found)
    known = kept_for(tmp_path, **changed).read()
    assert known is None if changed else known == found


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such modes")
@pytest.mark.parametrize("mode", [0o770, 0o707])
def test_nothing_is_kept_where_others_may_write(tmp_path, mode):
    kept_for(tmp_path).write("found")
    (tmp_path / "fits").chmod(mode)
    assert kept_for(tmp_path).read() is None
    (tmp_path / "fits").chmod(0o755)
    assert kept_for(tmp_path).read() == "found"


def test_nothing_is_kept_without_a_folder_nor_of_what_has_no_bytes(tmp_path):
    for folder, question in ((None, "law"), (tmp_path, (number for number in ()))):
        kept = KeptAnswer(folder, question)
        kept.write("found")
        assert kept.read() is None
    kept = KeptAnswer(tmp_path, "law")
    kept.write(lambda: None)
    assert kept.read() is None


def write_two(calls, broken, run):
    calls.append(1)

    def no_figure():
        if broken:
            raise ValueError("no room for the label")
        return {}

    run.text("law.txt", "mass")
    run.figures(no_figure)
    return ["measure at 0.3 m"]


@pytest.mark.parametrize("broken", [False, True])
def test_files_are_those_of_an_earlier_run_unless_a_figure_was_lacking(tmp_path, broken):
    calls: list[int] = []
    for name in ("one", "two"):
        folder = tmp_path / name
        output = _run.Output((folder, folder), fits=tmp_path / "fits")
        run = output.begin("improve", Path(__file__))
        assert run.kept(partial(write_two, calls, broken), "question") == ["measure at 0.3 m"]
        assert (folder / "law.txt").read_text() == "mass\n"
        assert run.files == ["law.txt"]
    assert len(calls) == 1 + broken


@pytest.mark.parametrize("is_asked_for", [False, True])
def test_where_a_figure_failed_is_told_where_it_is_asked_for(tmp_path, capsys, is_asked_for):
    output = _run.Output((tmp_path, tmp_path), traceback=is_asked_for)
    run = output.begin("improve", Path(__file__))
    write_two([], True, run)
    run.finish(output.screen, "A mass is missing.", {})
    told = capsys.readouterr().out
    assert "A figure was not drawn (ValueError: no room for the label)" in told
    assert ("with what --traceback tells." in told) != is_asked_for
    assert ("in no_figure" in told) == is_asked_for
