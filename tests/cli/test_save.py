"""`improve --save`: the completed model is a model file that explains the data."""

import dataclasses
import inspect
import runpy
import types

import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._shared.compiled import compiled
from bayes_placement.cli._save import CompletedModel, effect_as_typed
from bayes_placement.cli.improve import _beside_errors
from bayes_placement.criticism.missing._estimates import EFFECTS
from bayes_placement.criticism.missing._parameter_estimate import ParameterEstimate
from bayes_placement.criticism.missing.fitted_model import FittedModel
from bayes_placement.experiment.content_hash import content_hash
from bayes_placement.io.case._effects import _content
from tests import public_calls
from tests.cli.test_criticism import HIDDEN, MEASUREMENT, MODEL, run, written
from tests.criticism.small import experiment as small
from tests.io.case.test_folder import measured
from tests.io.case.test_folder import written as written_case


@pytest.mark.long
def test_the_completed_model_is_read_and_explains_the_data(tmp_path):
    model = written(tmp_path, MODEL, HIDDEN, MEASUREMENT)
    saved = tmp_path / "sub" / "completed.py"
    words = ("--effects", "point_mass", "--out", tmp_path / "out", "--save", saved)
    done = run("improve", model, *words)
    assert done.exit_code == 0, (done.output, done.exception)
    assert f"Completed model: {saved}" in done.output
    study = bp.io.model.read(saved)
    assert [effect.name for effect in study.experiment.effects] == ["point_mass"]
    posterior = bp.io.netcdf.read(tmp_path / "out" / "posterior.nc")
    mass = posterior["posterior"]["structure.effects.point_mass.mass"]
    assert float(mass.mean()) == pytest.approx(0.3, rel=0.2)
    misfit = bp.check(
        bp.infer(study.experiment, study.measurement, engine=bp.engines.MAP(draws=200))
    )
    assert misfit.passed
    known = bp.io.model.read(model).measurement
    assert content_hash(known) == content_hash(study.measurement)


@pytest.mark.parametrize("is_declared", [False, True])
@pytest.mark.parametrize("has_errors", [False, True])
def test_numbers_found_beside_a_model_error_that_is_not_declared_say_so(is_declared, has_errors):
    said = _beside_errors(is_declared, has_errors)
    assert ("with_model_error" in said) == (has_errors and not is_declared)


def around(unknown):
    """Estimate of an unknown as a ledger has it, at 0.3."""
    owner = unknown.owner.name if unknown.owner.kind in EFFECTS else None
    numbers = 0.3, 0.01, 0.27, 0.33, unknown.unit
    return ParameterEstimate(*numbers, owner, unknown.field, unknown.field, 0.28, 0.32)


def saved(folder, original, *added):
    """Text of a model that is completed by effects, and the experiment that is read from it."""
    experiment = original
    for effect in added:
        experiment = experiment + effect
    found = {unknown.name: around(unknown) for unknown in experiment.unknowns}
    last = FittedModel(None, (), found, 1.0, 0.5, 0.0, None, 0.0)
    ledger = types.SimpleNamespace(experiment=experiment, steps=[last])
    completed = CompletedModel(folder / "completed.py", folder / "study.py", None, False)
    inspect.unwrap(CompletedModel.write)(completed, original, ledger)
    text = (folder / "completed.py").read_text().replace("study.measurement", "None")
    (folder / "completed.py").write_text(text)
    return text, experiment, bp.io.model.read(folder / "completed.py").experiment


def test_a_network_is_written_as_it_is_typed(tmp_path):
    original = bp.io.model.read(written(tmp_path, MODEL)).experiment
    law = effects.Spring(dist.LogNormal(9.0, 4.6)) - effects.Springpot(
        dist.LogNormal(8.0, 4.6), dist.Uniform(0.0, 1.0), 50.0
    )
    (place,) = original.structure.modes.anywhere()
    text, _, read = saved(tmp_path, original, effects.attached(place, law, name="pad"))
    call = """bp.effects.attached(
    at=Uniform(0, 1),
    law=Spring(LogNormal(9, 4.6)) - Springpot(LogNormal(8, 4.6), Uniform(0, 1), 50.0),
    name='pad',
)
"""
    assert call in text
    assert "# at 300 mm (95 %: 280 to 320), " in text
    assert "from bayes_placement.effects import Spring, Springpot\n" in text
    assert "from numpyro.distributions import LogNormal, Uniform\n" in text
    (again,) = read.effects
    assert (again.name, repr(again.law)) == ("pad", repr(law))


def test_networks_struts_parts_and_several_effects_are_read_back(tmp_path):
    original = bp.io.model.read(written(tmp_path, MODEL)).experiment
    (place,) = original.structure.modes.anywhere()
    spring = effects.Spring(dist.LogUniform(1e3, 1e6))
    library = effects.library(original, ["segment_mass", "point_mass", "time_delay"]).effects
    first, *others = [effects.attached(place, spring - effects.Dashpot(40.0)), *library]
    joint = effects.inserted(place, spring, motion="displacement")
    added = [first, effects.strut(place, 0.7, spring), joint, *unlike(others)]
    text, experiment, read = saved(tmp_path, original, *added)
    values = dict.fromkeys(experiment.unknown, 0.3)
    exact, again = (
        np.asarray(compiled(bp.Experiment.frf)(each.fix(values))) for each in (experiment, read)
    )
    np.testing.assert_array_equal(exact, again)
    assert "to=0.7" in text and "bp.effects.segment_mass(\n" in text


def unlike(candidates):
    """The last candidate of each kind, which may have no text."""
    return list({candidate.kind: candidate for candidate in candidates}.values())


@pytest.mark.parametrize("make", [lambda: public_calls.in_space((0.5, 0.4, 0.0)), small])
def test_default_candidates_are_typed_as_they_are_or_not_at_all(make):
    of = make()
    candidates = effects.library(of, [*effects.EFFECTS]).effects
    texts = [effect_as_typed(candidate) for candidate in candidates]
    known = vars(dist) | vars(effects) | {"bp": bp}
    for candidate, text in zip(candidates, texts, strict=True):
        assert text is None or _content(eval(text, known)) == _content(candidate)
    assert sum(text is not None for text in texts) > len(candidates) / 2


IN_PYTHON = """
from tests.criticism.reach.cantilever import experiment as setup, maxwell, measured

experiment, measurement = setup(), measured(maxwell)
"""


@pytest.mark.long
@pytest.mark.longest
def test_a_completed_model_with_a_network_fits_as_the_search_said(tmp_path):
    model = tmp_path / "study.py"
    model.write_text(IN_PYTHON)
    study = bp.io.model.read(model)
    chosen = effects.library(study.experiment, ["point_mass", "tuned_absorber"])
    candidates = dataclasses.replace(chosen, networks=True)
    ledger = bp.improve(study.experiment, study.measurement, candidates=candidates)
    assert ledger.verdict == ("attached: dashpot - spring",)
    CompletedModel(tmp_path / "completed.py", model, None, False).write(study.experiment, ledger)
    completed = bp.io.model.read(tmp_path / "completed.py")
    found = runpy.run_path(str(tmp_path / "completed.py"))["found"]
    (one, predicted), (other, again) = (
        chi2(experiment, completed.measurement, found)
        for experiment in (ledger.experiment, completed.experiment)
    )
    np.testing.assert_array_equal(predicted, again)
    assert one == other == pytest.approx(ledger.steps[-1].chi2_per_datum, rel=0.02)


def chi2(experiment, measurement, values):
    """Squared residuals for each datum where the unknowns have these values, and predictions."""
    data = experiment.data(measurement)
    predicted = jnp.asarray(compiled(bp.Experiment.predict)(experiment.fix(values)))
    expected = experiment.noise.distribution(predicted, data)
    scores = (np.asarray(data.z) - predicted) / np.sqrt(np.asarray(expected.variance))
    return float(np.mean(np.abs(scores) ** 2)), np.asarray(predicted)


@pytest.mark.parametrize("name", ["study.py", "completed.txt"])
def test_nothing_is_replaced_by_a_saved_model(tmp_path, name):
    model = written(tmp_path, MODEL, HIDDEN, MEASUREMENT)
    before = model.read_text()
    done = run("improve", model, "--out", tmp_path / "out", "--save", tmp_path / name)
    assert done.exit_code == 2
    assert "nothing is replaced: --save study_completed.py" in " ".join(done.output.split())
    assert model.read_text() == before


@pytest.mark.parametrize(
    ("name", "option", "words"),
    [
        ("study_completed", (), "is no name of a Python file"),
        (
            "case_completed",
            ("--data", "measured.uff"),
            "beside --data; a model file is needed then",
        ),
        ("case_completed", ("--model-error",), "beside --model-error; a model file is needed then"),
        ("case", (), "is there already"),
    ],
)
def test_a_folder_holds_a_case_with_its_own_data_alone(tmp_path, name, option, words):
    model = written(tmp_path, MODEL)
    if name.startswith("case"):
        model = tmp_path / "case"
        model.mkdir()
    done = run("improve", model, *option, "--save", tmp_path / name)
    assert done.exit_code == 2
    assert words in " ".join(done.output.split())


@pytest.mark.long
@pytest.mark.longest
def test_a_case_is_completed_as_a_case(tmp_path):
    folder = tmp_path / "case"
    folder.mkdir()
    incomplete = bp.io.case.read(written_case(folder)).experiment
    hidden = (incomplete + bp.effects.point_mass(0.4, 2.0)).nominal()
    frf = np.asarray(compiled(bp.Experiment.frf)(hidden))
    coherence = np.full(frf.shape, 0.9999)
    written_case(folder, measured=measured(frf=frf, coherence=coherence))
    words = ("--effects", "point_mass", "--out", tmp_path / "out", "--save", tmp_path / "completed")
    done = run("improve", folder, *words)
    assert done.exit_code == 0, (done.output, done.exception)
    assert f"Completed model: {tmp_path / 'completed'}" in done.output
    completed = bp.io.case.read(tmp_path / "completed")
    assert [effect.name for effect in completed.experiment.effects] == ["point_mass"]
    assert (tmp_path / "out" / "posterior.nc").is_file()
