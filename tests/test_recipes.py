"""Recipes of CONTRIBUTING.md, followed literally in a copy of the package.

What the recipe for a file format reads is tested in tests/io/test_formats.py.
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

WRONG_CALLS = """
from bayes_placement import damping, effects, engines
from tests import public_calls
from tests.test_public_calls import check
calls = {
    "law": public_calls.of_law(damping.Zener),
    "effect": public_calls.of_effect(effects.cable),
    "engine": public_calls.of_engine(engines.Rejection),
    "reader": public_calls.of_reader("text_frf.read"),
}
said = public_calls.answers(calls)
assert len(said) > 40, said
check(said)
"""

LISTS = {
    "tests/test_public_calls.py": "test_every_public_callable_has_a_row",
    "tests/test_examples.py": "test_every_public_name_has_an_example",
    "tests/test_pages.py": "test_every_public_name_is_in_the_reference",
}
"""Tests that each public name is where it must be."""


def section(heading):
    return (ROOT / "CONTRIBUTING.md").read_text().split(f"## {heading}\n")[1].split("\n## ")[0]


def blocks(heading):
    """Code of a section, and the line for its registry."""
    return re.findall(r"```(?:python|text)\n(.*?)```", section(heading), flags=re.DOTALL)


def insert(file, marker, before="", after=""):
    """Write lines before and after one line of a file."""
    first, line, remaining = file.read_text().partition(marker)
    assert line, f"{file} has no {marker}"
    file.write_text(first + before + line + after + remaining)


def write(folder, code):
    """Write a file whose first line is its path."""
    path = re.match(r"# (bayes_placement/\S+\.py)\n", code)
    (folder / path[1]).write_text(code)


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """The package, its tests and pages, with a law, an effect, an engine and a format more."""
    folder = tmp_path_factory.mktemp("copy")
    for name in ("bayes_placement", "tests", "notebooks/docs"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    package = folder / "bayes_placement"

    law, line = blocks("Add a damping law")
    laws = "LAWS: tuple[type[Damping], ...] = (\n"
    insert(package / "experiment/damping.py", laws, before=law + "\n\n", after=line)
    reader, line, _ = blocks("Add a file format")
    write(folder, reader)
    insert(package / "io/formats.py", "FORMATS = [\n", after=line)
    for heading, registry in (
        ("Add an effect", "effects/registry.py"),
        ("Add an engine or a marginal", "inference/engines/__init__.pyi"),
    ):
        code, line = blocks(heading)
        write(folder, code)
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
    marked = ("-m", "long or not long", "-k", words)
    output = python(copy, "-m", "pytest", "-n", "0", "-q", *marked, *tests)
    passed = re.search(r"(\d+) passed", output)
    assert int(passed[1]) >= 16, output


@pytest.mark.long
def test_an_engine_samples_a_posterior_in_closed_form(copy):
    python(copy, "-c", ENGINE_CHECK)


@pytest.mark.long
def test_wrong_arguments_of_all_are_refused_without_a_further_edit(copy):
    python(copy, "-c", WRONG_CALLS)


@pytest.mark.long
def test_all_are_listed_and_have_examples_without_a_further_edit(copy):
    marked = ("-m", "long or not long", "-k", " or ".join(LISTS.values()))
    output = python(copy, "-m", "pytest", "-n", "0", "-q", *marked, *LISTS)
    assert "3 passed" in output


def test_an_effect_of_one_port_is_short():
    code, _ = blocks("Add an effect")
    assert len(code.strip().splitlines()) <= 45


def test_all_recipes_are_followed():
    headings = re.findall(r"^## (Add .*)$", (ROOT / "CONTRIBUTING.md").read_text(), re.MULTILINE)
    assert headings == [
        "Add a damping law",
        "Add an effect",
        "Add a file format",
        "Add an engine or a marginal",
    ]
