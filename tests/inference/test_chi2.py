"""A fitted model that fails says so in its result, where the noise is known."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement.criticism.check.check import verdict
from bayes_placement.inference.infer import InferenceWarning

LINES = np.linspace(50.0, 400.0, 40)
MASS = 0.3  # [kg], of 9 kg


def bar(noise):
    beam = bp.beams.bar(6, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    return bp.Experiment(
        bp.Structure(beam, damping=bp.damping.Modal(dist.LogNormal(np.log(0.04), 0.3))),
        sensors=[bp.Sensor("s1", at=0.2)],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=LINES,
        observe=bp.observe.Complex("velocity"),
        noise=noise,
    )


def measured(hidden_mass):
    """What is measured of a bar that hides a mass."""
    truth = bar(None).fix({"structure.damping.ratio": 0.04})
    truth = truth + bp.effects.point_mass(0.7, hidden_mass) if hidden_mass else truth
    frf = np.asarray(compiled(bp.Experiment.frf)(truth))
    size = 0.02 * np.abs(frf).mean()
    parts = np.random.default_rng(3).normal(size=(2, *frf.shape))
    noisy = frf + size * (parts[0] + 1j * parts[1])
    names = {"sensors": ["s1+x"], "actuators": ["a1+x"], "quantity": "mobility"}
    return bp.Measurement.from_arrays(noisy, LINES, **names), size


def fitted(hidden_mass, known=True):
    measurement, size = measured(hidden_mass)
    noise = bp.noise.Gaussian(size if known else dist.LogUniform(0.1 * size, 1e3 * size))
    return bp.infer(bar(noise), measurement, engine=bp.engines.MAP(starts=4))


@pytest.fixture(scope="module")
def failing():
    return fitted(MASS)


def test_a_result_whose_model_fails_says_so_and_where_to_ask(failing):
    sentence = failing.attrs["misfit"]
    judged = verdict(failing)
    assert judged.failed and sentence.startswith(judged.sentence())
    assert sentence.endswith("bp.check(result) says where it fails.")
    assert sentence in str(bp.report({"MAP": failing}))
    assert bp.report({"MAP": failing}).words()[0] == f"MAP: {sentence}"
    assert failing.attrs["warnings"] == []  # the inference itself has nothing to warn of


def test_a_result_whose_model_explains_the_data_says_nothing():
    result = fitted(0.0)
    assert verdict(result).passed
    assert "misfit" not in result.attrs
    assert not bp.report({"MAP": result}).misfits


@pytest.mark.long
@pytest.mark.longest
def test_where_the_noise_is_fitted_chi2_says_nothing():
    assert "misfit" not in fitted(MASS, known=False).attrs


def test_the_sentence_is_kept_in_a_file(failing, tmp_path):
    back = bp.io.netcdf.read(bp.io.netcdf.write(failing, tmp_path / "result.nc"))
    assert bp.report({"MAP": back}).misfits == [f"MAP: {failing.attrs['misfit']}"]


@pytest.mark.long
def test_a_likelihood_that_is_too_broad_says_nothing_about_the_model():
    """The paper's bar, which lacks nothing; the kernels are many times as wide as the error."""
    modes = bp.beams.bar(8, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    experiment = bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal([dist.Uniform(0.02, 0.06), 0.04])),
        sensors=[bp.Sensor("s1", at=bp.positions.Segment(0.25, within=0.04))],
        actuators=[bp.Actuator("a1", at=bp.positions.Segment(0.30, within=0.04))],
        frequency=(np.arange(1, 11) - 0.5) * 43.3,
        observe=bp.observe.LogAmplitude("velocity"),
        noise=bp.noise.Gaussian(0.002),
    )
    truth = {"sensor.s1.position": 0.262, "actuator.a1.position": 0.283}
    known = experiment.fix({**truth, "structure.damping.ratio.1": 0.035})
    engine, marginal = bp.engines.Importance(draws=300), bp.marginals.KDE(placement_draws=200)
    measurement = known.nominal_measurement()
    with pytest.warns(InferenceWarning, match="kernels of the density"):
        result = bp.infer(experiment, measurement, engine=engine, marginal=marginal)
    assert verdict(result).failed  # by the draws, which are not those of the model's posterior
    assert "misfit" not in result.attrs
