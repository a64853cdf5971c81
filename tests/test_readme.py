"""The Python blocks of README.md run, section by section in their order."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
COMMANDS = ("pip", "python", "bayes-placement")
FENCED = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"(?<=\n\n)((?: {4}.*\n|\n)+)")
SAVED = re.compile(r"[Ss]ave (?:this|it) as\s+`(\w+\.py)`")
CLUSTER = "dask_jobqueue"


class Block(NamedTuple):
    """A block of code, and the name of the file in which the text before it says to save it."""

    code: str
    file: str | None


def sections():
    """Blocks in Python of each section, by its title."""
    text = (ROOT / "README.md").read_text()
    parts = re.split(r"^## (.+)$", text, flags=re.MULTILINE)[1:]
    titles, bodies = parts[::2], parts[1::2]
    code_blocks = {title: blocks(body) for title, body in zip(titles, bodies, strict=True)}
    return {title: code for title, code in code_blocks.items() if code}


def blocks(text):
    """Blocks in Python of a section: those that are fenced, and those that are indented."""
    fenced = [(match.start(), match.end(), match[1]) for match in FENCED.finditer(text)]
    outside = FENCED.sub(lambda match: re.sub(r"[^\n]", "-", match[0]), text)
    indented = [
        (match.start(), match.end(), re.sub(r"^ {4}", "", match[1], flags=re.MULTILINE))
        for match in INDENTED.finditer(outside)
        if match[1].strip() and not match[1].strip().startswith(COMMANDS)
    ]
    ordered, end_before, result = sorted(fenced + indented), 0, []
    for start, end, code in ordered:
        names = SAVED.findall(text[end_before:start])
        result.append(Block(code, names[-1] if names else None))
        end_before = end
    return result


SECTIONS = sections()


def test_all_blocks_of_the_readme_are_found():
    text = (ROOT / "README.md").read_text()
    codes = [block.code for section in SECTIONS.values() for block in section]
    assert sum(code in text for code in codes) >= text.count("```python") > 4
    calls = [line.strip() for line in text.splitlines() if re.match(r" {4}.*\bbp\.", line)]
    assert len(calls) > 20
    assert all(any(call in code for code in codes) for call in calls)
    assert {block.file for section in SECTIONS.values() for block in section} > {"my_model.py"}


RUN = """
import pathlib, sys

namespace = {"__name__": "__main__"}
for name in sys.argv[1:]:
    exec(compile(pathlib.Path(name).read_text(), name, "exec"), namespace)
"""
"""Blocks run one after another, as in a notebook; the processes that they start do not run them."""

FOR_TESTS = ("JAX_DISABLE_MOST_OPTIMIZATIONS", "XLA_FLAGS")
"""What tests set so that JAX compiles faster: a user has functions that run faster."""


@pytest.mark.long
@pytest.mark.parametrize(
    ("title", "words", "figures"),
    [
        ("Where to place sensors", "nat", {"map.png", "tolerances.png"}),
        ("Your own structure", "point_mass", {"residual_map.png", "error_falls.png"}),
        ("Frames, plates and finite element models", "point_mass", {"suspicion.png"}),
        ("Real measurements", "model_error.frequency.size", set()),
        ("Time records", "Hit 4 of 7 is left out", set()),
    ],
)
def test_blocks_run_in_their_order(title, words, figures, tmp_path):
    shutil.copytree(ROOT / "models", tmp_path / "models")
    environment = {key: value for key, value in os.environ.items() if key not in FOR_TESTS}
    ran = subprocess.run(
        [sys.executable, "-c", RUN, *written(SECTIONS[title], tmp_path)],
        cwd=tmp_path,
        env=environment | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert words in ran.stdout
    assert figures <= {path.name for path in tmp_path.iterdir()}


def written(section, folder):
    """Names of the files of the blocks that can run here, as they are to be saved."""
    names = []
    for number, block in enumerate(section):
        if CLUSTER in block.code and importlib.util.find_spec(CLUSTER) is None:
            continue  # it needs a cluster run by Slurm
        names.append(block.file or f"block_{number}.py")
        (folder / names[-1]).write_text(block.code)
    return names


def test_every_section_with_code_is_run():
    (marks,) = [
        mark for mark in test_blocks_run_in_their_order.pytestmark if mark.name == "parametrize"
    ]
    assert {row[0] for row in marks.args[1]} == set(SECTIONS)
