"""README.md is short, its two commands come first, and its blocks in Python run in their order."""

import re

import pytest

from tests.code_blocks import ROOT, blocks, run

README = (ROOT / "README.md").read_text()
MOST_LINES, MOST_WORDS = 120, 900
"""What is read in three minutes."""


def test_it_is_read_in_three_minutes():
    assert len(README.splitlines()) <= MOST_LINES
    assert len(README.split()) <= MOST_WORDS


def test_two_commands_come_first():
    typed = re.findall(r"^ {4}(\S.*)$", README, re.MULTILINE)
    assert typed[:2] == [
        "pip install . && bayes-placement improve models/hidden_effect.py",
        'pip install ".[test]" && python -m pytest',
    ]


@pytest.mark.long
def test_blocks_run_in_their_order(tmp_path):
    code = blocks(README)
    assert len(code) == README.count("```python") == 2
    (printed,) = run([code], tmp_path)
    assert "Missing: point_mass, 0.54018 kg at 370.002 mm" in printed
    assert (tmp_path / "error_falls.png").is_file()
    assert (tmp_path / "my_model.py").is_file()
