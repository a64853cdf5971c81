"""Simulated responses compared with Figure 2 of the paper, reproducible by seed."""

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled

BAR = bp.beams.bar(15, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
FIRST, SECOND, FOURTH = 500 / 3, 1000 / 3, 2000 / 3
HIGH = np.linspace(1800.0, 2200.0, 13)
# Figures 1 and 2: sensors at P1 and P2, the force at 0.3 m, every place within 4 cm.
P1, P2, FORCE = 0.5, 0.25, 0.3


def experiment(place, noise=None, damping=0.04):
    return bp.Experiment(
        bp.Structure(BAR, damping=bp.damping.Modal([damping])),
        sensors=[bp.Sensor("P1", at=place(P1)), bp.Sensor("P2", at=place(P2))],
        actuators=[bp.Actuator("a1", at=place(FORCE))],
        frequency=np.array([FIRST, SECOND, FOURTH, *HIGH]),
        observe=bp.observe.LogAmplitude("velocity"),
        noise=noise,
    )


def glued(position):
    return bp.positions.Segment(position, within=0.04)


@pytest.fixture(scope="module")
def figure_2():
    """Response [draw, sensor, frequency] for a random place of everything."""
    tree = bp.simulate(experiment(glued), draws=1000, key=5)
    return tree["prior_predictive"]["response"].sel(chain=0, actuator="a1+x")


def uncertain():
    """The same with an unknown damping ratio and an output error."""
    return experiment(glued, bp.noise.Gaussian(0.3), dist.Uniform(0.02, 0.06))


@pytest.fixture(scope="module")
def drawn():
    return bp.simulate(uncertain(), draws=1000, key=3)


@pytest.fixture(scope="module")
def exact():
    """Response [sensor, frequency] at the exact places, Figure 1."""
    return np.asarray(compiled(bp.Experiment.predict)(experiment(lambda position: position))[:, 0])


def spread(response, sensor, frequency):
    low, high = response.sel(sensor=f"{sensor}+x", frequency=frequency).quantile([0.05, 0.95])
    return float(high - low)


def test_the_first_resonance_fluctuates_more_where_its_shape_is_steep(figure_2):
    # P1 is the top of the first shape, P2 its flank.
    assert spread(figure_2, "P2", FIRST) > 1.3 * spread(figure_2, "P1", FIRST)


def test_the_second_resonance_fluctuates_more_at_its_node(figure_2):
    assert spread(figure_2, "P1", SECOND) > 4 * spread(figure_2, "P2", SECOND)


def test_resonances_that_vanish_at_exact_places_appear_at_random_ones(figure_2, exact):
    # Mode 2 at P1, mode 4 at both: found in the mean, whose standard error is below 0.01.
    mean = figure_2.mean("draw").values
    assert mean[0, 1] > exact[0, 1] + 0.1
    assert np.all(mean[:, 2] > exact[:, 2] + 0.05)
    # Where a resonance does not vanish, random places leave its mean alone.
    assert np.all(np.abs(mean - exact)[:, 0] < 0.01)


def test_resonances_at_short_wavelengths_average_out(figure_2, exact):
    mean = figure_2.mean("draw").values[:, 3:]
    assert np.all(np.ptp(mean, axis=1) < 0.5 * np.ptp(exact[:, 3:], axis=1))


def test_draws_follow_their_prior(drawn):
    prior = drawn["prior"]
    assert list(prior.data_vars) == [
        "structure.damping.ratio.1",
        "sensor.P1.position",
        "sensor.P2.position",
        "actuator.a1.position",
    ]
    assert prior["sensor.P1.position"].attrs == {
        "units": "m",
        "role": "placement",
        "owner": "sensor P1",
        "field": "position",
        "component": "",
    }
    for name, centre, half in [
        ("sensor.P1.position", P1, 0.04),
        ("sensor.P2.position", P2, 0.04),
        ("actuator.a1.position", FORCE, 0.04),
        ("structure.damping.ratio.1", 0.04, 0.02),
    ]:
        values = prior[name].values
        assert values.shape == (1, 1000)
        assert np.all(np.abs(values - centre) <= half)
        error = half / np.sqrt(3 * values.size)
        assert abs(values.mean() - centre) < 5 * error
        assert len(np.unique(values)) == values.size


def test_the_output_error_is_added_to_the_response(drawn):
    predictive = drawn["prior_predictive"]
    error = (predictive["measured"] - predictive["response"]).values
    assert predictive["measured"].dims == ("chain", "draw", "sensor", "actuator", "frequency")
    assert abs(error.mean()) < 5 * 0.3 / np.sqrt(error.size)
    assert abs(error.std() - 0.3) < 5 * 0.3 / np.sqrt(2 * error.size)


def test_without_noise_nothing_is_measured():
    tree = bp.simulate(experiment(glued), draws=2)
    assert list(tree["prior_predictive"].data_vars) == ["response"]


def test_each_draw_is_the_response_to_its_own_places(drawn):
    values = {name: jnp.asarray(v.values[0, 2]) for name, v in drawn["prior"].items()}
    expected = jax.jit(lambda places: uncertain().fix(places).predict())(values)
    response = drawn["prior_predictive"]["response"][0, 2]
    np.testing.assert_allclose(response, expected, rtol=1e-12)


@pytest.mark.parametrize("key", [np.int64(3), jax.random.PRNGKey(3)])
def test_one_key_gives_one_result_bit_for_bit(drawn, key):
    again = bp.simulate(uncertain(), draws=1000, key=key)
    other = bp.simulate(uncertain(), draws=1000, key=4)
    for group in ("prior", "prior_predictive"):
        assert drawn[group].to_dataset().identical(again[group].to_dataset())
        for name, values in drawn[group].data_vars.items():
            assert not np.any(values.values == other[group][name].values)


def test_an_experiment_without_unknowns_can_be_simulated():
    tree = bp.simulate(experiment(lambda position: position), draws=3, key=0)
    assert not tree["prior"].data_vars
    response = tree["prior_predictive"]["response"]
    assert response.sizes["draw"] == 3
    assert float((response - response.isel(draw=0)).max()) == 0.0
