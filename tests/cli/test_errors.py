"""Errors on the command line: ours in one sentence, those of a model file with traceback."""

import ast
import json
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from bayes_placement._shared.errors import InputError, NumericalError, WorkerError
from bayes_placement.cli import _command, check
from bayes_placement.cli._inputs import print_data_faults
from bayes_placement.cli._terminal import Screen
from bayes_placement.cli.app import app
from bayes_placement.io.model import Study
from tests.cli.studies import EXPERIMENT
from tests.experiment.measured_bars import free_beam, measured

PACKAGE = Path(_command.__file__).parents[1]


def run(folder, text, *options):
    path = folder / "study.py"
    path.write_text(text)
    return CliRunner().invoke(app, ["check", str(path), "--out", str(folder / "out"), *options])


def test_an_error_in_the_model_file_keeps_its_traceback(tmp_path):
    answer = run(tmp_path, "def half(x):\n    return x / 0\n\nexperiment = half(1)\n")
    assert answer.exit_code == 3
    first, line, *_, last = answer.output.splitlines()
    assert first == "Traceback (most recent call last):"
    assert line == f'  File "{tmp_path / "study.py"}", line 4, in <module>'
    assert "line 2, in half" in answer.output
    assert last == "ZeroDivisionError: division by zero"


@pytest.mark.parametrize(
    "text", ["raise ValueError('mine')", "open('no such file')", "import no_such_module_at_all"]
)
def test_no_error_of_the_model_files_own_is_taken_for_ours(tmp_path, text):
    answer = run(tmp_path, text)
    assert answer.exit_code == 3
    assert answer.output.startswith("Traceback")
    assert "study.py" in answer.output.splitlines()[1]


@pytest.mark.parametrize(("modulus", "stops"), [(1e-9, True), (1e-9, False), (1e9, True)])
def test_a_model_with_all_natural_frequencies_below_the_lines_stops_a_command(modulus, stops):
    study = Study(free_beam(modulus), None, None, {})
    arguments = Screen.of(quiet=True, as_json=False), study, measured(free_beam())
    if stops and modulus < 1:
        with pytest.raises(InputError, match="no natural frequency of the model lies there"):
            print_data_faults(*arguments, stops=stops)
    else:
        assert "no natural frequency" in print_data_faults(*arguments, stops=stops)[0]


TRACED = """import jax, jax.numpy as jnp
from near import product

experiment = jax.jit(product)(jnp.ones(3))
"""
NEAR = """import jax.numpy as jnp

def product(x):
    return x if jnp.sum(x) > 0 else -x
"""


def test_of_an_error_in_a_library_the_users_frames_are_shown_alone(tmp_path):
    (tmp_path / "near.py").write_text(NEAR)
    lines = run(tmp_path, TRACED).output.splitlines()
    assert [line for line in lines if 'File "' in line] == [
        f'  File "{tmp_path / "study.py"}", line 4, in <module>',
        f'  File "{tmp_path / "near.py"}", line 4, in product',
    ]
    assert len(lines) < 12
    assert "TRACEBACK_FILTERING" not in " ".join(lines)


def test_a_mistake_of_syntax_is_shown_with_its_line_alone(tmp_path):
    answer = run(tmp_path, "experiment = (\n")
    assert answer.exit_code == 3
    first, *_, last = answer.output.splitlines()
    assert first == f'  File "{tmp_path / "study.py"}", line 1'
    assert last == "SyntaxError: '(' was never closed"


def test_our_own_error_in_the_model_file_tells_its_line(tmp_path):
    text = "import bayes_placement as bp\n\nmodes = bp.beams.bar(0, length=1.0, area=1.0, "
    answer = run(tmp_path, text + "youngs_modulus=1.0, density=1.0)\n")
    assert answer.exit_code == 3
    (line,) = answer.output.splitlines()
    assert line.startswith("error: study.py, line 3: modes=0 was given")


def test_a_data_file_that_the_model_misses_is_one_sentence(tmp_path):
    text = "import bayes_placement as bp\nmeasurement = bp.io.uff.read('missing.uff')\n"
    answer = run(tmp_path, text)
    assert answer.exit_code == 2
    assert answer.output.startswith("error: study.py, line 2: There is no file missing.uff")


@pytest.mark.parametrize("error", [ValueError("inside"), TypeError("inside")])
def test_an_error_within_this_package_keeps_all_of_its_traceback(tmp_path, monkeypatch, error):
    def broken(*arguments, **settings):
        raise error

    monkeypatch.setattr(check, "check", broken)
    monkeypatch.setattr(check, "infer_posterior", lambda *arguments: None)
    answer = run(tmp_path, EXPERIMENT + "measurement = experiment.nominal_measurement()\n")
    assert answer.exit_code == 4
    assert answer.output.splitlines()[-1] == f"{type(error).__name__}: inside"
    assert "in broken" in answer.output


def test_a_traceback_of_our_own_errors_is_shown_if_asked_for(tmp_path):
    answer = run(tmp_path, EXPERIMENT, "--traceback")
    assert answer.exit_code == 2
    assert "Traceback" in answer.output and "declares no `measurement`" in answer.output


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (NumericalError("No step."), "error: No step."),
        (WorkerError("A worker was lost."), "error: A worker was lost."),
        (MemoryError("74 GiB"), "error: There is too little memory (74 GiB); as much is needed"),
        (RuntimeError("RESOURCE_EXHAUSTED: 9"), "error: There is too little memory (RESOURCE_EXHA"),
    ],
)
def test_a_computation_that_cannot_go_on_is_one_sentence(tmp_path, monkeypatch, error, sentence):
    def broken(*arguments, **settings):
        raise error

    monkeypatch.setattr(check, "check", broken)
    monkeypatch.setattr(check, "infer_posterior", lambda *arguments: None)
    answer = run(tmp_path, EXPERIMENT + "measurement = experiment.nominal_measurement()\n")
    assert answer.exit_code == 4
    assert answer.output.splitlines()[-1].startswith(sentence)


def test_a_missing_extra_is_named_in_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    path = tmp_path / "study.py"
    path.write_text(EXPERIMENT)
    words = ["place", str(path), "--dask", "local", "--out", str(tmp_path / "out")]
    answer = CliRunner().invoke(app, words)
    assert answer.exit_code == 4
    assert 'pip install "bayes_placement[dask]"' in answer.output
    assert "Traceback" not in answer.output


def test_warnings_of_numpy_are_shown_for_the_model_file_alone(tmp_path):
    out = tmp_path / "out"
    common = _command.Common(
        tmp_path / "study.py", "check", out, False, False, False, True, False, False
    )
    log_of_zero = "numpy.log10(numpy.zeros(1))"
    with warnings.catch_warnings(record=True) as caught:
        warnings.resetwarnings()
        with _command.begun(common):
            exec(log_of_zero, {"__name__": "bayes_placement.frf", "numpy": np})
            assert not caught
            exec(log_of_zero, {"__name__": "_model_study", "numpy": np})
    assert [warning.category for warning in caught] == [RuntimeWarning]


def test_an_error_is_an_object_where_json_is_asked_for(tmp_path):
    answer = run(tmp_path, EXPERIMENT, "--json")
    assert answer.exit_code == 2
    content = json.loads(answer.stdout)
    assert content["exit_code"] == 2
    assert "declares no `measurement`" in content["error"]


PLAIN = ("ValueError", "ImportError", "RuntimeError", "ArithmeticError")


def test_errors_with_our_sentences_are_of_our_own_classes():
    offenders = [
        f"{path.relative_to(PACKAGE)}, line {node.lineno}"
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in PLAIN
    ]
    assert not offenders, (
        "raise errors of `_shared/errors.py`, which the command line tells in one sentence"
    )
