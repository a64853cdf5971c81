"""What `--help` says: units, examples, effects by group, and where to begin."""

import re

import pytest
from typer.testing import CliRunner

from bayes_placement.cli._command import GROUPS, LAWS
from bayes_placement.cli.app import app
from bayes_placement.effects import EFFECTS

COMMANDS = [command.name or command.callback.__name__ for command in app.registered_commands]


def said(*words):
    """Help of a command, in wide lines."""
    done = CliRunner().invoke(app, [*words, "--help"], env={"COLUMNS": "200"})
    assert done.exit_code == 0
    return done.stdout


def test_init_comes_first():
    text = said()
    assert text.index("bayes-placement init") < text.index("Exit codes")
    assert re.search(r"─ Begin ─+╮\n│ init ", text)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_an_example_and_no_type_of_flags(command):
    text = said(command)
    assert f"• bayes-placement {command} " in text
    assert "<bool>" not in text


def test_units_are_shown():
    assert "Least distance [m] between sensors" in said("place")
    assert "x [mm], tolerance [mm]" in said("init")


@pytest.mark.parametrize("command", ["explain", "improve"])
def test_effects_are_listed_by_group(command):
    text = said(command)
    assert "• supports: compliant_support, soft_support, loose_joint" in text
    assert [name for name in set(EFFECTS) - LAWS if not re.search(rf"\b{name}\b", text)] == []


def test_effects_have_one_group():
    named = [name for words in GROUPS.values() for name in words.split()]
    assert len(named) == len({*named})
    assert {*named, *LAWS} <= {*EFFECTS}
