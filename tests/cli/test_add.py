"""`add`: a model with one effect more, from numbers as they are typed."""

import pytest
from typer.testing import CliRunner

import bayes_placement as bp
from bayes_placement.cli.app import app
from tests.cli.studies import EXPERIMENT


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "study.py"
    path.write_text(EXPERIMENT + "measurement = experiment.nominal_measurement()\n")
    return path


def add(model, *words):
    new = model.parent / "folder" / "new.py"
    new.parent.mkdir(exist_ok=True)
    done = CliRunner().invoke(app, ["add", str(model), *words, "--save", str(new)])
    assert "Traceback" not in done.output
    return done, new


def test_numbers_places_and_priors_are_those_that_were_typed(model):
    typed = ("--at=0.37", "--mass", "Uniform(-0.5, 0.5)")
    done, new = add(model, "point_mass", *typed)
    assert done.exit_code == 0, (done.output, done.exception)
    assert f"Next: bayes-placement show {new}" in done.output
    study = bp.io.model.read(new)
    (effect,) = study.experiment.effects
    assert (effect.kind, effect.at, effect.mass.low) == ("point_mass", 0.37, -0.5)
    assert study.measurement is not None


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("point_mas", "--at", "0.3"), 2, "Did you mean 'point_mass'?"),
        (("point_mass", "--at", "0.3"), 2, r"needs --mass; .*: --at [m] --mass [kg]"),
        (("point_mass", "--at", "0.3", "--mas", "1"), 2, "has no --mas;"),
        (("point_mass", "0.3", "--mass", "1"), 2, "as a name and a value"),
        (("attached", "--at", "0.3", "--law", "Spring"), 2, "its law is typed in Python"),
        (("point_mass", "--at", "5", "--mass", "1"), 3, "lies outside the structure"),
        (("point_mass", "--at", "0.3", "--mass", "heavy"), 2, "a number [kg] is needed"),
    ],
)
def test_what_is_wrong_is_said(model, words, code, said):
    done, new = add(model, *words)
    assert done.exit_code == code, done.output
    assert all(part in done.output for part in said.split(".*"))
    assert not new.exists()


def test_nothing_is_replaced(model):
    assert add(model, "point_mass", "--at", "0.3", "--mass", "1")[0].exit_code == 0
    done, _ = add(model, "point_mass", "--at", "0.3", "--mass", "2")
    assert done.exit_code == 2 and "is there already" in done.output
