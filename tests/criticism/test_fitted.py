"""_fitted: a model with values beside the data, and the error beside the noise."""

import jax
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.fitted import fitted

SIGMA = 0.3
RATIOS = dist.Uniform(np.full(2, 0.02), np.array([0.04, 0.06]))
VALUES = {
    "structure.damping.ratios[0]": 0.03,
    "structure.damping.ratios[1]": 0.04,
    "actuator.a1.position": 0.3,
}


def experiment(observe):
    return bp.Experiment(
        bp.Structure(
            bp.beams.bar(2, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0),
            damping=bp.damping.Modal(RATIOS),
        ),
        sensors=[bp.Sensor("s1", at=0.2), bp.Sensor("s2", at=0.45)],
        actuators=[bp.Actuator("a1", at=bp.positions.Segment(0.3, within=0.1))],
        frequency=[120.0, 166.0, 300.0],
        observe=observe,
        noise=bp.noise.Gaussian(SIGMA),
    )


def named(values):
    """Values under the names that the unknowns bear."""
    (ratios,) = [one.name for one in experiment(bp.observe.Complex("velocity")).unknowns][:1]
    return {name.replace("structure.damping.ratios", ratios): x for name, x in values.items()}


@pytest.mark.parametrize("observe", [bp.observe.Complex, bp.observe.LogAmplitude])
def test_at_the_truth_nothing_is_left(observe):
    one = experiment(observe("velocity"))
    found = fitted(one, one.nominal_measurement(), named(VALUES))
    np.testing.assert_allclose(found["predicted"], found["measured"], rtol=1e-12)
    np.testing.assert_allclose(found["error"], 0.0, atol=1e-12)
    frf = np.asarray(jax.jit(lambda: one.nominal().frf())())
    np.testing.assert_allclose(found["measured"], np.log10(np.abs(frf)))


def test_the_error_of_a_complex_response_is_its_distance_in_the_plane():
    one = experiment(bp.observe.Complex("velocity"))
    other = named(VALUES | {"actuator.a1.position": 0.35})
    found = fitted(one, one.nominal_measurement(), other)
    moved = one.fix({"actuator.a1.position": 0.35}).nominal()
    true, false = (np.asarray(jax.jit(lambda e=e: e.frf())()) for e in (one.nominal(), moved))
    np.testing.assert_allclose(found["error"], np.abs(true - false))
    # Two parts of deviation sigma each.
    np.testing.assert_allclose(found["noise"], np.sqrt(2) * SIGMA)
    assert found["error"].attrs["units"] == "velocity per force [(m/s)/N]"
    assert found["predicted"].attrs["units"] == "log10 of velocity per force [(m/s)/N]"


def test_the_error_of_a_logarithm_is_in_its_own_unit():
    one = experiment(bp.observe.LogAmplitude("velocity"))
    other = named(VALUES | {"actuator.a1.position": 0.35})
    found = fitted(one, one.nominal_measurement(), other)
    np.testing.assert_allclose(found["error"], np.abs(found["measured"] - found["predicted"]))
    np.testing.assert_allclose(found["noise"], SIGMA)


def test_each_element_of_an_array_has_its_own_value():
    one = experiment(bp.observe.Complex("velocity"))
    measured = one.nominal_measurement()
    first, second = (
        fitted(one, measured, named(VALUES | {f"structure.damping.ratios[{n}]": 0.035}))["error"]
        for n in range(2)
    )
    # At 166 Hz, the first resonance, the first ratio decides; the second hardly matters.
    assert np.all(first[..., 1] > 20 * second[..., 1])


def test_what_was_not_measured_is_left_blank():
    one = experiment(bp.observe.Complex("velocity"))
    whole = one.nominal_measurement()
    frf = np.array(whole.frf)
    frf[1, 0] = np.nan
    gap = bp.Measurement.from_arrays(
        frf, whole.frequency, sensors=["s1", "s2"], actuators=["a1"], quantity="mobility"
    )
    found = fitted(one, gap, named(VALUES))
    for name in ("measured", "predicted", "error", "noise"):
        blank = np.isnan(found[name].values)
        assert np.all(blank[1]) and not np.any(blank[0])
