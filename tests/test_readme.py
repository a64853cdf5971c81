"""The Python blocks of README.md run, section by section in their order."""

import importlib.util
import re
import shutil
import sys
import warnings
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


@pytest.mark.long
@pytest.mark.parametrize(
    ("title", "words", "figures"),
    [
        ("Your own structure", "point_mass", {"residual_map.png", "error_falls.png"}),
        ("Frames, plates and finite element models", "point_mass", {"suspicion.png"}),
        ("Real measurements", "model_error.frequency.size", set()),
        ("Where to place sensors", "nat", {"map.png", "tolerances.png"}),
    ],
)
def test_blocks_run_in_their_order(title, words, figures, tmp_path, monkeypatch, capsys):
    shutil.copytree(ROOT / "models", tmp_path / "models")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    namespace = {"__name__": "__main__"}
    with warnings.catch_warnings():
        warnings.simplefilter("default")  # as in the terminal of a user
        for block in SECTIONS[title]:
            run(block, namespace)
    assert words in capsys.readouterr().out
    assert figures <= {path.name for path in tmp_path.iterdir()}


def run(block, namespace):
    if CLUSTER in block.code and importlib.util.find_spec(CLUSTER) is None:
        return  # it needs a cluster run by Slurm
    name = block.file or "README.md"
    if block.file:
        Path(block.file).write_text(block.code)
        sys.modules.pop(Path(block.file).stem, None)
    exec(compile(block.code, name, "exec"), namespace)


def test_every_section_with_code_is_run():
    (marks,) = [
        mark for mark in test_blocks_run_in_their_order.pytestmark if mark.name == "parametrize"
    ]
    assert {row[0] for row in marks.args[1]} == set(SECTIONS)
