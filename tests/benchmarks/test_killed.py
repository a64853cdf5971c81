"""Every command killed at 50 random moments; about a quarter of an hour.

Run with `python -m pytest tests/benchmarks/test_killed.py -n 0 -m long`.
"""

import pytest

from tests.cli.killed_commands import killed_at

MOMENTS = 50

pytestmark = pytest.mark.long


@pytest.mark.parametrize("command", ["update", "improve", "place", "report", "import"])
def test_a_command_that_is_killed_often_leaves_complete_files(tmp_path, command):
    assert killed_at(tmp_path, command, MOMENTS) > MOMENTS / 2
