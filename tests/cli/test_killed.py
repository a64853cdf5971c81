"""A command that is killed leaves complete files, and the next run ends as if nothing had been."""

import pytest

from tests.cli.killed_commands import killed_at


@pytest.mark.long
@pytest.mark.longest
def test_a_command_that_is_killed_leaves_complete_files(tmp_path):
    killed_at(tmp_path, "place", 2)
