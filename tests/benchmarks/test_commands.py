"""Benchmarks: commands of the README, from their start to their end.

Run with `python -m pytest tests/benchmarks/test_commands.py -n 0`.
"""

import shutil

import pytest

from tests.benchmarks.fresh import seconds_of, seconds_of_python
from tests.benchmarks.page import ROOT, at_most
from tests.code_blocks import blocks

HELP, MAIN, UPDATE = 0.4, (16.0, 7.0), 90.0
"""Seconds asked: of `--help`, of the main example at first and then, and of `update`."""

BASE = "import jax, numpyro"
KEPT, SHOWN = 3.0, 2.0
"""Seconds asked beyond these imports: of a run whose answer is kept; of what computes nothing."""


@pytest.fixture
def study(tmp_path):
    """A folder with README's `my_model.py` and the data that it reads."""
    (tmp_path / "models").mkdir()
    shutil.copy(ROOT / "models/hidden_effect.uff", tmp_path / "models")
    saved = {block.file: block.code for block in blocks((ROOT / "README.md").read_text())}
    (tmp_path / "my_model.py").write_text(saved["my_model.py"])
    return tmp_path


def test_help(page, tmp_path):
    took = [seconds_of(["--help"], tmp_path) for _ in range(6)]
    page.add("bayes-placement --help", min(took), "s", at_most(HELP))


def test_the_main_example(page, tmp_path):
    known = 0
    for order, most in zip(("first", "second"), MAIN, strict=True):
        took = seconds_of(["improve", str(ROOT / "models/hidden_effect.py")], tmp_path)
        page.add(f"main example, {order} run", took, "s", at_most(most))
        # Each process of a search keeps what takes it a hundredth of a second to compile.
        compiled = sum(1 for _ in (tmp_path / "caches").rglob("*-cache"))
        page.add(f"main example, functions compiled in the {order} run", compiled - known, "")
        known = compiled


def test_what_is_beyond_the_imports_of_others(page, tmp_path):
    model = str(ROOT / "models/hidden_effect.py")
    results = "results/hidden_effect/improve-1"
    commands = {
        "main example, answer kept": (["improve", model], KEPT),
        "show of its model": (["show", model], SHOWN),
        "report of its run": (["report", results], SHOWN),
    }
    for _ in range(2):  # the second run has all that the first compiled
        seconds_of(["improve", model], tmp_path)
    base = min(seconds_of_python(["-c", BASE], tmp_path) for _ in range(3))
    for words, (command, most) in commands.items():
        took = min(seconds_of(command, tmp_path) for _ in range(2))
        page.add(f"{words}, beyond `{BASE}`", took - base, "s", at_most(most))


def test_update_of_my_model(page, study):
    page.add(
        "update my_model.py", seconds_of(["update", "my_model.py"], study), "s", at_most(UPDATE)
    )
