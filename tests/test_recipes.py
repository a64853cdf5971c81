"""Recipes of CONTRIBUTING.md, followed literally in a copy of the package.

The recipe for a file format is followed in tests/io/test_formats.py.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

ENGINE_CHECK = """
import jax
import numpy as np
from bayes_placement import engines
from tests.inference.engines.test_engines import COVARIANCE, MEAN, run
target, draws = run(engines.Rejection(proposals=20_000))
values = jax.vmap(target.constrain)(draws.position[0])
position = np.stack([np.asarray(values[name]) for name in "ab"], axis=1)
error = (position.mean(axis=0) - MEAN) / np.sqrt(np.diag(COVARIANCE) / len(position))
assert len(position) > 100 and draws.warnings == () and np.abs(error).max() < 5, error
_, draws = run(engines.Rejection(proposals=250))
assert "use engines.SMC" in draws.warnings[0]
"""


def section(heading):
    return (ROOT / "CONTRIBUTING.md").read_text().split(f"## {heading}\n")[1].split("\n## ")[0]


def blocks(heading):
    """Code of a section, and the line for its registry."""
    return re.findall(r"```(?:python|text)\n(.*?)```", section(heading), flags=re.DOTALL)


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """The package and its tests, with a law, an effect and an engine more."""
    folder = tmp_path_factory.mktemp("copy")
    for name in ("bayes_placement", "tests"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    package = folder / "bayes_placement"

    law, line = blocks("Add a damping law")
    file = package / "experiment/damping.py"
    before, marker, after = file.read_text().partition("LAWS: tuple[type[Damping], ...] = (\n")
    file.write_text(before + law + "\n\n" + marker + line + after)

    for heading, registry in (
        ("Add an effect", "effects/registry.py"),
        ("Add an engine or a marginal", "inference/engines/__init__.pyi"),
    ):
        code, line = blocks(heading)
        path = re.match(r"# (bayes_placement/\S+\.py)\n", code)
        (folder / path[1]).write_text(code)
        with (package / registry).open("a") as lines:
            lines.write(line)
    return folder


def python(folder, *arguments):
    """Run Python in the copy, with the compiled functions of these tests at hand."""
    environment = os.environ | {"PYTHONPATH": str(folder)}
    command = [sys.executable, *arguments]
    run = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout[-4000:] + run.stderr[-4000:]
    return run.stdout


@pytest.mark.long
def test_a_law_and_an_effect_pass_their_tests_without_a_further_edit(copy):
    words = "(zener and free-fixed) or cable or every_effect"
    tests = ("tests/test_laws.py", "tests/effects/test_effect_laws.py")
    told = python(copy, "-m", "pytest", "-n", "0", "-q", "-k", words, *tests)
    passed = re.search(r"(\d+) passed", told)
    assert int(passed[1]) >= 16, told


@pytest.mark.long
def test_an_engine_samples_a_posterior_in_closed_form(copy):
    python(copy, "-c", ENGINE_CHECK)


def test_all_recipes_are_followed():
    headings = re.findall(r"^## (Add .*)$", (ROOT / "CONTRIBUTING.md").read_text(), re.MULTILINE)
    assert headings == [
        "Add a damping law",
        "Add an effect",
        "Add a file format",
        "Add an engine or a marginal",
    ]
