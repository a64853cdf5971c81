"""The Python blocks of README.md run, section by section in their order."""

import re

import pytest

from tests.code_blocks import ROOT, blocks, run


def sections():
    """Blocks in Python of each section, by its title."""
    text = (ROOT / "README.md").read_text()
    parts = re.split(r"^## (.+)$", text, flags=re.MULTILINE)[1:]
    titles, bodies = parts[::2], parts[1::2]
    code_blocks = {title: blocks(body) for title, body in zip(titles, bodies, strict=True)}
    return {title: code for title, code in code_blocks.items() if code}


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
        ("Where to place sensors", "nat", {"map.png", "tolerances.png"}),
        ("Your own structure", "point_mass", {"residual_map.png", "error_falls.png"}),
        (
            "Frames, plates and finite element models",
            r"Missing: point_mass, .* falls from 24\d{3} to (0\.9|1)",
            {"suspicion.png"},
        ),
        ("Real measurements", r"model_error\.frequency\.size", set()),
        ("Time records", "Hit 4 of 7 is left out", set()),
    ],
)
def test_blocks_run_in_their_order(title, words, figures, tmp_path):
    (output,) = run([SECTIONS[title]], tmp_path)
    assert re.search(words, output)
    assert figures <= {path.name for path in tmp_path.iterdir()}


def test_every_section_with_code_is_run():
    (marks,) = [
        mark for mark in test_blocks_run_in_their_order.pytestmark if mark.name == "parametrize"
    ]
    assert {row[0] for row in marks.args[1]} == set(SECTIONS)
