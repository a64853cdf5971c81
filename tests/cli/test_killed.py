"""Commands that are killed leave complete files, and the next run ends as if nothing had been."""

import pytest

from tests.cli.killed_commands import killed_at

COMMANDS = ("update", "improve", "place", "report", "import")


def test_a_command_that_is_killed_leaves_complete_files(tmp_path):
    killed_at(tmp_path, "place", 2)


@pytest.mark.long
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_that_is_killed_often_leaves_complete_files(tmp_path, command):
    assert killed_at(tmp_path, command, 50) > 25
