"""Predicted outputs of a fitted model compared with the data, and errors with the noise."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
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
    (ratios,) = [unknown.name for unknown in experiment(bp.observe.Complex("velocity")).unknowns][
        :1
    ]
    return {name.replace("structure.damping.ratios", ratios): x for name, x in values.items()}


@pytest.mark.parametrize("observe", [bp.observe.Complex, bp.observe.LogAmplitude])
def test_at_the_truth_nothing_is_left(observe):
    bar = experiment(observe("velocity"))
    table = fitted(bar, bar.nominal_measurement(), named(VALUES))
    np.testing.assert_allclose(table["predicted"], table["measured"], rtol=1e-12)
    np.testing.assert_allclose(table["error"], 0.0, atol=1e-12)
    frf = np.asarray(compiled(bp.Experiment.frf)(bar.nominal()))
    np.testing.assert_allclose(table["measured"], np.log10(np.abs(frf)))


def test_the_error_of_a_complex_response_is_its_distance_in_the_plane():
    bar = experiment(bp.observe.Complex("velocity"))
    values = named(VALUES | {"actuator.a1.position": 0.35})
    table = fitted(bar, bar.nominal_measurement(), values)
    moved = bar.fix({"actuator.a1.position": 0.35}).nominal()
    true, false = (np.asarray(compiled(bp.Experiment.frf)(e)) for e in (bar.nominal(), moved))
    np.testing.assert_allclose(table["error"], np.abs(true - false))
    # Two parts of deviation sigma each.
    np.testing.assert_allclose(table["noise"], np.sqrt(2) * SIGMA)
    assert table["error"].attrs["units"] == "velocity per force [(m/s)/N]"
    assert table["predicted"].attrs["units"] == "log10 of velocity per force [(m/s)/N]"


def test_the_error_of_a_logarithm_is_in_its_own_unit():
    bar = experiment(bp.observe.LogAmplitude("velocity"))
    values = named(VALUES | {"actuator.a1.position": 0.35})
    table = fitted(bar, bar.nominal_measurement(), values)
    np.testing.assert_allclose(table["error"], np.abs(table["measured"] - table["predicted"]))
    np.testing.assert_allclose(table["noise"], SIGMA)


def test_each_element_of_an_array_has_its_own_value():
    bar = experiment(bp.observe.Complex("velocity"))
    measured = bar.nominal_measurement()
    first, second = (
        fitted(bar, measured, named(VALUES | {f"structure.damping.ratios[{n}]": 0.035}))["error"]
        for n in range(2)
    )
    # At 166 Hz, the first resonance, the first ratio decides; the second hardly matters.
    assert np.all(first[..., 1] > 20 * second[..., 1])


def test_what_was_not_measured_is_left_blank():
    bar = experiment(bp.observe.Complex("velocity"))
    measurement = bar.nominal_measurement()
    frf = np.array(measurement.frf)
    frf[1, 0] = np.nan
    gap = bp.Measurement.from_arrays(
        frf, measurement.frequency, sensors=["s1", "s2"], actuators=["a1"], quantity="mobility"
    )
    table = fitted(bar, gap, named(VALUES))
    for name in ("measured", "predicted", "error", "noise"):
        blank = np.isnan(table[name].values)
        assert np.all(blank[1]) and not np.any(blank[0])
