"""`improve --save`: the mended model is a model file that explains the data."""

import pytest

import bayes_placement as bp
from bayes_placement.experiment.content_hash import content_hash
from tests.cli.test_criticism import HIDDEN, MEASUREMENT, MODEL, run, written


@pytest.mark.long
def test_the_mended_model_is_read_and_explains_the_data(tmp_path):
    model = written(tmp_path, MODEL, HIDDEN, MEASUREMENT)
    saved = tmp_path / "sub" / "mended.py"
    words = ("--effects", "point_mass", "--out", tmp_path / "out", "--save", saved)
    done = run("improve", model, *words)
    assert done.exit_code == 0, (done.output, done.exception)
    assert f"Mended model: {saved}" in done.output
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


@pytest.mark.parametrize("name", ["study.py", "mended.txt"])
def test_nothing_is_replaced_by_a_saved_model(tmp_path, name):
    model = written(tmp_path, MODEL, HIDDEN, MEASUREMENT)
    before = model.read_text()
    done = run("improve", model, "--out", tmp_path / "out", "--save", tmp_path / name)
    assert done.exit_code == 2
    assert "nothing is replaced: --save study_mended.py" in " ".join(done.output.split())
    assert model.read_text() == before
