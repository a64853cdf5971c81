"""Sensors and effects of any name through all commands, each with its report."""

import csv
import html
import json
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.cli.app import app
from tests.cli.studies import EXPERIMENT

STUDY = """
names = {names!r}
experiment = bp.Experiment(
    bp.Structure(modes, damping=bp.damping.Modal([dist.Uniform(0.02, 0.06)]))
    + bp.effects.point_mass(0.6, mass=0.1, name=names[0]),
    sensors=[bp.Sensor(name, at=0.1 + 0.08 * n) for n, name in enumerate(names)],
    actuators=[bp.Actuator("a1", at=bp.positions.Segment(0.3, within=0.04))],
    frequency=[150.0, 166.0, 182.0, 198.0],
    observe=bp.observe.LogAmplitude("velocity"),
    noise=bp.noise.Gaussian(0.05),
)
measurement = experiment.nominal_measurement()
"""
COMMANDS = (
    "show",
    "check --report",
    "update --engine importance --report",
    "explain --effects point_mass --report",
    "improve --effects point_mass --report",
    "place --sensors 1 --places 4 --lines 2 --report",
)
NAMES = st.text(min_size=1, max_size=12) | st.text("$_^\\{}%&<>'\"=+-@ax1 #~", min_size=1)


def is_refused(name):
    """Whether a name is refused where it is given."""
    try:
        bp.Sensor(name, at=0.1)
    except InputError:
        return True
    return False


def check(out, names):
    """Refuse files that lack a name."""
    with (out / "channels.csv").open(newline="", encoding="utf-8") as file:
        rows = [row["name"].removeprefix("'") for row in csv.DictReader(file)]
    assert {name.removeprefix("'") for name in names} <= {*rows}
    record = json.loads((out / "run.json").read_text(encoding="utf-8"))
    assert all(run["finished"] for run in record.values())
    page = html.unescape((out / "report.html").read_text(encoding="utf-8"))
    assert all(name in page for name in names)


@pytest.mark.long
@pytest.mark.longest
@given(st.lists(NAMES, min_size=10, max_size=10, unique=True))
@settings(
    max_examples=20,
    phases=[Phase.generate],
    deadline=None,
    suppress_health_check=[*HealthCheck],
    derandomize=True,
)
def test_any_name_is_refused_at_once_or_carried_to_every_file(names):
    accepted = [name for name in names if not is_refused(name)] or ["s1"]
    with tempfile.TemporaryDirectory() as folder:
        study, out = Path(folder, "study.py"), Path(folder, "out")
        study.write_text(EXPERIMENT + STUDY.format(names=accepted), encoding="utf-8")
        for command in COMMANDS:
            name, *options = command.split()
            answer = CliRunner().invoke(app, [name, str(study), "--out", str(out), *options])
            assert answer.exit_code in (0, 1), (accepted, command, answer.output)
        check(out, accepted)
