"""Positions at nodes: exact sums over them, and their limit as the mesh is refined."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.special import logsumexp

import bayes_placement as bp
from bayes_placement import positions
from bayes_placement._shared.sites import substitute
from bayes_placement.inference.unconstrained import UnconstrainedModel
from tests import in_space

KEY = jax.random.PRNGKey(7)
PATCH = positions.Patch((0.53, 0.41, 0.3), (1, 0, 0), (0, 1, 0), within=(0.21, 0.17))
DRIVEN = (0.13, 0.67, 0.22)
RATIO = {"structure.damping.ratio.1": 0.03}


def mesh(*counts):
    """Nodes of a regular mesh of the whole structure."""
    sides = zip(*in_space.BOUNDS, counts, strict=True)
    axes = [np.linspace(low, high, count + 1) for low, high, count in sides]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def experiment(sensors, actuators, noise=0.3, effects=()):
    structure = bp.Structure(
        in_space.Linear(), damping=bp.damping.Modal([dist.Uniform(0.01, 0.06), 0.05, 0.03])
    )
    for effect in effects:
        structure = structure + effect
    return bp.Experiment(
        structure,
        sensors=[
            bp.Sensor(f"s{i}", directions=(3,), **options) for i, options in enumerate(sensors, 1)
        ],
        actuators=[
            bp.Actuator(f"a{i}", directions=(1,), **options)
            for i, options in enumerate(actuators, 1)
        ],
        frequency=[38.0, 66.0, 100.0],
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.Gaussian(noise),
    )


@functools.cache
def measured():
    """Outputs of a sensor off its record, of two sensors and two actuators."""
    truth = experiment(
        [{"at": (0.58, 0.37, 0.3)}, {"at": (0.8, 0.15, 0.5)}],
        [{"at": DRIVEN}, {"at": (0.9, 0.1, 0.4)}],
    )
    return truth.nominal_measurement()


def at_nodes(counts, support=PATCH, **options):
    return {"at": positions.Nodes(mesh(*counts), support), **options}


def log_likelihood(setup, marginal, values):
    data = setup.data(measured())
    distributions = {unknown.name: unknown.distribution for unknown in marginal.sampled(setup)}
    target = UnconstrainedModel(marginal.model(setup, data, KEY), distributions)
    return float(jax.jit(lambda flat: target.log_likelihood(flat))(target.flatten(values)))


def term(setup, data):
    return jnp.sum(setup.noise.distribution(setup.predict(), data).log_prob(data.z))


def summed(setup, values):
    """Log of the sum over every combination of nodes, one response each."""
    data = setup.data(measured())
    fixed = substitute(setup, values)
    distributions = {unknown.name: unknown.distribution for unknown in fixed.unknowns}
    grids = np.meshgrid(
        *(np.arange(distribution.probs.size) for distribution in distributions.values()),
        indexing="ij",
    )
    weights = np.meshgrid(
        *(np.log(distribution.probs) for distribution in distributions.values()), indexing="ij"
    )
    nodes = {
        name: jnp.asarray(grid.ravel()) for name, grid in zip(distributions, grids, strict=True)
    }
    terms = jax.jit(jax.vmap(lambda node: term(substitute(fixed, node), data)))(nodes)
    return logsumexp(np.asarray(terms) + sum(weights).ravel())


def experiment_at_nodes():
    """Two sensors and two actuators at nodes, and a mass at one of them."""
    box = positions.Box((0.5, 0.4, 0.3), within=(0.2, 0.15, 0.0))
    return experiment(
        [at_nodes((5, 4, 2), box), at_nodes((6, 4, 1), positions.Ball((0.8, 0.2, 0.5), 0.15))],
        [at_nodes((4, 3, 2), box), {"at": (0.9, 0.1, 0.4)}],
        effects=[
            bp.effects.point_mass(
                at=positions.Nodes(mesh(2, 1, 1)[[0, 4, 7]]), mass=dist.Uniform(0.0, 0.1)
            )
        ],
    )


SEVERAL = {**RATIO, "structure.effects.point_mass.mass": 0.04}


def test_nodes_of_transducers_and_effects_are_summed_exactly():
    setup = experiment_at_nodes()
    value = log_likelihood(setup, bp.marginals.Enumeration(), SEVERAL)
    assert value == pytest.approx(summed(setup, SEVERAL), rel=1e-12)
    other = SEVERAL | {"actuator.a1.position.node": 0}
    assert value != pytest.approx(summed(setup, other), abs=0.01)


def test_quadrature_sums_positions_at_nodes():
    setup = experiment([at_nodes((5, 4, 2))], [{"at": DRIVEN, "angles": (0.0, 0.1, 0.0)}])
    value = log_likelihood(setup, bp.marginals.Quadrature(nodes=5), RATIO)
    assert value == pytest.approx(summed(setup, RATIO), rel=1e-12)


def test_quadrature_mixes_nodes_and_continuous_coordinates():
    rolled = (0.0, dist.Uniform(-0.3, 0.5), 0.0)
    setup = experiment([at_nodes((5, 4, 2), angles=rolled)], [{"at": DRIVEN}])
    value = log_likelihood(setup, bp.marginals.Quadrature(nodes=24), RATIO)
    node, weight = np.polynomial.legendre.leggauss(24)
    data, fixed = setup.data(measured()), substitute(setup, RATIO)
    distribution = setup.sensor["s1"].position.node
    angles, nodes = np.meshgrid(0.1 + 0.4 * node, np.arange(distribution.probs.size))

    def at(angle, place):
        values = {"sensor.s1.angles.2": angle, "sensor.s1.position.node": place}
        return term(substitute(fixed, values), data)

    terms = jax.jit(jax.vmap(jax.vmap(at)))(angles, nodes)
    expected = logsumexp(terms + np.log(weight / 2) + np.log(distribution.probs)[:, None])
    assert value == pytest.approx(expected, rel=1e-12)


def test_only_gauss_nodes_count_in_what_resolves_an_integral():
    # Under no data, what is effective of Gauss nodes is known, whatever the weights of the mesh.
    rolled = {"angles": (0.0, dist.Uniform(-0.3, 0.5), 0.0)}
    box = positions.Box((0.5, 0.4, 0.3), within=(0.2, 0.0, 0.0))
    setup = experiment(
        [{"at": DRIVEN}, {"at": PATCH.centre}],
        [at_nodes((4, 2, 2), box, **rolled), at_nodes((4, 2, 2), box, **rolled)],
        noise=1e6,
    )
    data, fixed = setup.data(measured()), substitute(setup, RATIO)
    resolve = bp.marginals.Quadrature(nodes=6).placement(setup, data, KEY)
    _, weight = np.polynomial.legendre.leggauss(6)
    _, stats = jax.jit(lambda: resolve(fixed, KEY))()
    assert float(stats["node_ess"]) == pytest.approx(np.sum(weight) ** 2 / np.sum(weight**2))


def test_all_but_nodes_is_left_to_the_engine():
    rolled = (0.0, dist.Uniform(-0.3, 0.5), 0.0)
    setup = experiment([at_nodes((5, 4, 2), angles=rolled), {"at": PATCH}], [{"at": DRIVEN}])
    names = [unknown.name for unknown in bp.marginals.Enumeration().sampled(setup)]
    assert names == [
        "structure.damping.ratio.1",
        "sensor.s1.angles.2",
        "sensor.s2.position.first",
        "sensor.s2.position.second",
    ]


@pytest.mark.long
def test_the_nearest_node_converges_to_the_place_at_second_order():
    # A node in the middle of its cell is a midpoint rule; cells that the support cuts are as many
    # as its edge is long over h, each h^2 large and off its middle by h: all of it is h^2.
    smooth = experiment([{"at": PATCH}], [{"at": DRIVEN}])
    exact = log_likelihood(smooth, bp.marginals.Quadrature(nodes=20), RATIO)
    sizes = np.array([10, 20, 40, 80])
    errors = [
        abs(
            log_likelihood(
                experiment([at_nodes((n, n, 2))], [{"at": DRIVEN}]),
                bp.marginals.Enumeration(),
                RATIO,
            )
            - exact
        )
        for n in sizes
    ]
    rate = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert errors[-1] < 3e-4, errors
    assert 1.6 < rate < 2.6, (rate, errors)


def test_nodes_drawn_back_follow_their_share_of_the_likelihood():
    setup = substitute(
        experiment([at_nodes((5, 4, 2), PATCH)], [at_nodes((3, 3, 1), None)], noise=0.1), RATIO
    )
    data = setup.data(measured())
    resolve = bp.marginals.Enumeration().placement(setup, data, KEY)
    drawn, stats = jax.jit(jax.vmap(lambda key: resolve(setup, key)))(jax.random.split(KEY, 4000))
    assert stats == {}
    counts = [setup.sensor["s1"].position.row.size, setup.actuator["a1"].position.row.size]
    grids = np.meshgrid(*map(np.arange, counts), indexing="ij")
    names = ["sensor.s1.position.node", "actuator.a1.position.node"]
    values = dict(zip(names, map(jnp.ravel, grids), strict=True))
    terms = np.asarray(jax.jit(jax.vmap(lambda v: term(substitute(setup, v), data)))(values))
    prior = np.asarray(setup.sensor["s1"].position.node.probs)[:, None]
    share = np.exp(terms.reshape(counts)) * prior
    share /= np.sum(share)
    estimate = np.zeros(counts)
    np.add.at(estimate, tuple(np.asarray(drawn[name]) for name in names), 1 / 4000)
    assert np.max(share) < 0.9
    np.testing.assert_array_less(
        np.abs(estimate - share), 5 * np.sqrt(share * (1 - share) / 4000) + 1e-3
    )


@pytest.mark.long
def test_nodes_are_inferred_and_stored():
    setup = experiment([at_nodes((5, 4, 2))], [{"at": DRIVEN}], noise=0.05)
    options = {"engine": bp.engines.Grid(nodes=16), "marginal": bp.marginals.Enumeration()}
    posterior = bp.infer(setup, measured(), **options)
    node = posterior["posterior"]["sensor.s1.position.node"].values
    place = setup.sensor["s1"].position
    assert set(np.unique(node)) <= set(range(place.row.size))
    assert posterior.attrs["marginal"] == "Enumeration"
    assert "node_ess" not in posterior["sample_stats"]


def test_sampling_along_nodes_is_refused():
    setup = experiment([at_nodes((5, 4, 2))], [{"at": DRIVEN}])
    with pytest.raises(
        ValueError, match=r"discrete distribution, .* Sum over it by marginals.Enumeration\(\)"
    ):
        bp.infer(setup, measured())


def test_a_sum_over_no_nodes_is_refused():
    setup = experiment([{"at": PATCH}], [{"at": DRIVEN}])
    with pytest.raises(ValueError, match=r"none is unknown. Declare one, at=positions.Nodes"):
        bp.marginals.Enumeration().model(setup, setup.data(measured()), KEY)


def test_too_many_nodes_are_refused():
    fine = at_nodes((40, 40, 2))
    setup = experiment([fine, fine], [fine, fine])
    with pytest.raises(ValueError, match=r"would compute .* 2 coordinates are integrated together"):
        bp.marginals.Enumeration().model(setup, setup.data(measured()), KEY)


@pytest.mark.parametrize("marginal", [bp.marginals.Enumeration(), bp.marginals.Quadrature()])
def test_instruments_that_depend_on_each_other_are_refused(marginal):
    setup = experiment([at_nodes((5, 4, 2))], [{"at": DRIVEN}]) + bp.effects.gain_error("s1", 0.1)
    words = f"marginals.{type(marginal).__name__} was given an experiment with the effect"
    with pytest.raises(ValueError, match=words):
        marginal.model(setup, setup.data(measured()), KEY)
