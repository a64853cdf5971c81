"""`improve --save`: the completed model is a model file that explains the data."""

import inspect
import types

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._compiled import compiled
from bayes_placement.cli._save import CompletedModel
from bayes_placement.experiment.content_hash import content_hash
from tests.cli.test_criticism import HIDDEN, MEASUREMENT, MODEL, run, written
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


def test_a_network_is_written_as_it_is_typed(tmp_path):
    original = bp.io.model.read(written(tmp_path, MODEL)).experiment
    law = effects.Spring(dist.LogNormal(9.0, 4.6)) - effects.Springpot(
        dist.LogNormal(8.0, 4.6), dist.Uniform(0.0, 1.0), 50.0
    )
    (place,) = original.structure.modes.anywhere()
    pad = effects.attached(place, law, name="attached")
    ledger = types.SimpleNamespace(experiment=original + pad)
    saved = CompletedModel(tmp_path / "completed.py", tmp_path / "study.py", None, False)
    inspect.unwrap(CompletedModel.write)(saved, original, ledger)
    (tmp_path / "completed.py").write_text(
        (tmp_path / "completed.py").read_text().replace("study.measurement", "None")
    )
    (again,) = bp.io.model.read(tmp_path / "completed.py").experiment.effects
    assert (again.name, again.kind) == ("attached", "attached: spring - springpot")
    assert repr(again.law) == repr(law) and (again.at.low, again.at.high) == (place.low, place.high)


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
