"""What a further measurement tells: sharper parameters, and which explanation is right."""

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.stats import multivariate_normal, norm

import bayes_placement as bp
from bayes_placement import information
from bayes_placement.design.information._sampling import PosteriorDraws, prior_knowledge
from bayes_placement.design.information.estimator import jackknife_error
from models import bar
from tests.design.information.linear import FORMS, SIGMA, linear_experiment

NAME = "instrument_effects.offsets.factor"
ALONG = FORMS / SIGMA
COVARIANCE = np.array([[0.3, -0.25], [-0.25, 0.6]])
RATIOS = ("structure.damping.ratio.1", "structure.damping.ratio.2")


def estimated(estimator, experiment, moved=()):
    plan = estimator.plan(experiment, 0, moved)
    gain = jax.jit(lambda: plan(experiment, experiment.nominal_values()))()
    return float(gain.estimate), float(jackknife_error(np.asarray(gain.jackknife)))


def normal_draws(mean, covariance, count=4000, seed=1):
    return {NAME: np.random.default_rng(seed).multivariate_normal(mean, covariance, size=count)}


@pytest.fixture(scope="module")
def linear():
    return linear_experiment()


def test_after_a_measurement_the_gain_is_that_of_its_posterior(linear):
    """In closed form: half of log det of one plus what the lines tell of the covariance left."""
    truth = 0.5 * np.linalg.slogdet(np.eye(3) + ALONG.T @ COVARIANCE @ ALONG)[1]
    after = normal_draws([0.4, -1.0], COVARIANCE)
    estimator = information.ExpectedGain(
        draws=1024, placement_draws=1, data_draws=512, replicates=8, after=after
    )
    gain, error = estimated(estimator, linear)
    assert error < 0.03
    assert abs(gain - truth) < 4 * np.hypot(error, 0.01)  # and the draws are but 4000
    before, _ = estimated(
        information.ExpectedGain(draws=512, placement_draws=1, data_draws=256), linear
    )
    assert before > gain + 0.1


def test_draws_belong_together(linear):
    """Half as much is learnt about two that are known by their difference only."""
    apart = np.array([[0.3, 0.29], [0.29, 0.3]])
    draws = PosteriorDraws(normal_draws([0.0, 0.0], apart))
    values = np.asarray(draws.values(np.random.default_rng(0).normal(size=(4, 500, 1)))[NAME])
    assert values.shape == (4, 500, 2)
    np.testing.assert_allclose(np.cov(values.reshape(-1, 2).T), apart, atol=0.05)
    two = PosteriorDraws({"one": np.arange(50.0), "other": np.arange(50.0) + 1.0})
    pair = two.values(np.random.default_rng(1).normal(size=(2, 30, 1)))
    np.testing.assert_array_equal(pair["other"] - pair["one"], 1.0)
    assert len(np.unique(pair["one"])) > 20
    first, second = draws.halves()
    assert not set(first.draws[NAME][:, 0]) & set(second.draws[NAME][:, 0])


def alternatives(linear):
    """Two explanations that predict different means and spreads."""
    distributions = (([0.4, -1.0], COVARIANCE, 3.0), ([1.1, -0.6], 0.1 * np.eye(2), 1.0))
    return distributions, [
        information.Alternative(str(number), probability, linear, normal_draws(mean, covariance))
        for number, (mean, covariance, probability) in enumerate(distributions)
    ]


def mutual_information(distributions, count=400_000):
    """By Monte Carlo with the exact densities of the data."""
    weights = np.array([weight for *_, weight in distributions])
    weights /= weights.sum()
    exact = [
        multivariate_normal(mean @ ALONG, np.eye(3) + ALONG.T @ covariance @ ALONG)
        for mean, covariance, _ in [(np.array(m), c, w) for m, c, w in distributions]
    ]
    total = 0.0
    for number, (distribution, weight) in enumerate(zip(exact, weights, strict=True)):
        y = distribution.rvs(count, random_state=number)
        densities = np.array([explanation.pdf(y) for explanation in exact])
        total += weight * np.mean(np.log(densities[number] / (weights @ densities)))
    return total


@pytest.mark.long
def test_separation_is_the_mutual_information(linear):
    distributions, explanations = alternatives(linear)
    truth = mutual_information(distributions)
    gain, error = estimated(
        information.Separation(explanations, draws=1024, data_draws=512), linear
    )
    assert 0.1 < truth < np.log(2)
    assert error < 0.02
    assert abs(gain - truth) < 4 * np.hypot(error, 0.005)


def test_explanations_that_predict_alike_are_not_told_apart(linear):
    _, explanations = alternatives(linear)
    gain, error = estimated(information.Separation([explanations[0], explanations[0]]), linear)
    assert abs(gain) < 4 * error + 1e-3


def test_a_structure_of_its_own_predicts_by_itself():
    """A mass that is there or not: plain to see where the structure moves, not at a node."""
    base = bar.placed(0.4, 0.45, bp.noise.Gaussian(0.02), structure=bar.bar(0.04, 0.04))
    heavy = base + bp.effects.point_mass(mass=dist.Uniform(0.3, 0.5), at=0.35, name="mass")
    light = base + bp.effects.ground_spring(
        stiffness=dist.Uniform(1e6, 2e6), at=0.35, name="spring"
    )
    rng = np.random.default_rng(0)
    explanations = [
        information.Alternative(name, 1.0, explained, {unknown: rng.uniform(low, high, 200)})
        for name, explained, unknown, (low, high) in (
            ("mass", heavy, "structure.effects.mass.mass", (0.3, 0.5)),
            ("spring", light, "structure.effects.spring.stiffness", (1e6, 2e6)),
        )
    ]
    estimator = information.Separation(explanations, draws=64, data_draws=64)
    gain = bp.information_map(base, {"s1": [0.06, 0.35]}, estimator=estimator)
    assert np.all(gain["information_gain"] < np.log(2) + 1e-9)
    assert float(gain["information_gain"].max()) > 0.3


SPRING, DASHPOT = bp.effects.Spring(2e4), bp.effects.Dashpot(30.0)
LINEAR_SOLID = SPRING | (DASHPOT - bp.effects.Spring(4e4))
NETWORKS = {
    "another law": ((0.31, LINEAR_SOLID), (0.31, bp.effects.LossySpring(3e4, 0.3))),
    "another place": ((0.3, LINEAR_SOLID), (0.5, LINEAR_SOLID)),
}
PLACES = [0.12, 0.42, 0.7, 0.88]


def at_one_line(noise=1.0, sensor=0.12, actuator=0.2):
    modes = bp.beams.bar(12, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.04)),
        sensors=[bp.Sensor("s1", at=sensor)],
        actuators=[bp.Actuator("a1", at=actuator)],
        frequency=[180.0],
        observe=bp.observe.Complex("velocity"),
        noise=bp.noise.Gaussian(noise),
    )


def about(place, law):
    """A network of which the place is known to some micrometres, and its draws."""
    network = bp.effects.attached(dist.Uniform(place - 1e-5, place + 1e-5), law, name="network")
    random = np.random.default_rng(0)
    draws = {"structure.effects.network.at": random.uniform(place - 1e-5, place + 1e-5, 100)}
    return information.Alternative(repr(law), 1.0, at_one_line() + network, draws)


def receptance(here, there):
    bare = at_one_line(sensor=here, actuator=there).nominal()
    return complex(np.asarray(bare.receptance()).item())


def mobility_at(place, law, sensor):
    """Mobility of the bar with a network, from its receptances without: one port closed by hand."""
    omega = 2 * np.pi * 180.0
    z = complex(law.dynamic_stiffness(jnp.array([omega]))[0])
    through = receptance(sensor, place) * receptance(place, 0.2)
    return 1j * omega * (receptance(sensor, 0.2) - through * z / (1 + z * receptance(place, place)))


def information_of_two(distance):
    """Mutual information [nat] of data and which of two unit normal distributions is right."""
    x = np.linspace(-12.0, 12.0 + distance, 20001)
    one, other = norm.pdf(x), norm.pdf(x - distance)
    mixture = 0.5 * (one + other)
    terms = (density * np.log(density / mixture) for density in (one, other))
    return 0.5 * sum(np.trapezoid(term, x) for term in terms)


@pytest.mark.parametrize(
    "rivals",
    [
        pytest.param("another place", marks=pytest.mark.long),
        pytest.param("another law", marks=[pytest.mark.long, pytest.mark.longest]),
    ],
)
def test_networks_are_told_apart_as_two_normal_distributions_are(rivals):
    one, other = NETWORKS[rivals]
    apart = np.array([abs(mobility_at(*one, at) - mobility_at(*other, at)) for at in PLACES])
    noise = apart.max() / 2.0
    expected = [information_of_two(distance) for distance in apart / noise]
    estimator = information.Separation([about(*one), about(*other)], draws=64, data_draws=256)
    best = bp.place(at_one_line(noise), {"s1": PLACES}, estimator=estimator)
    table = best.table.set_index("s1").loc[PLACES]
    gains, errors = table["information_gain"].to_numpy(), table["information_gain_se"].to_numpy()
    assert np.all(np.abs(gains - expected) < 4 * errors + 0.01)
    assert best.positions["s1"] == PLACES[int(np.argmax(expected))]
    assert np.all(gains < (apart / noise) ** 2 / 4 + 5 * errors)  # mean of both divergences, shared


def test_what_stays_mounted_is_known_by_the_measurement():
    experiment = bar.placed(0.25, 0.3, bp.noise.Gaussian(0.05))
    rng = np.random.default_rng(2)
    after = {name: rng.uniform(0.03, 0.05, 50) for name in RATIOS}
    after |= {
        f"{transducer}.position": rng.normal(0.26, 0.001, 50)
        for transducer in ("sensor.s1", "actuator.a1")
    }
    assert prior_knowledge(experiment, after, ["s1"]).names == (*RATIOS, "actuator.a1.position")
    assert prior_knowledge(experiment, after, ["s1", "a1"]).names == RATIOS
    assert prior_knowledge(experiment, None, ["s1"]).names == RATIOS


@pytest.mark.parametrize(
    "estimator",
    [
        information.KernelGain(draws=64, placement_draws=64),
        pytest.param(information.Exact(draws=64, nodes=8), marks=pytest.mark.long),
    ],
)
def test_each_estimator_goes_on_from_a_posterior(estimator):
    """Nothing is left to be learnt of what is known, and the nominal values are its means."""
    experiment = bar.placed(0.25, 0.3, bp.noise.Gaussian(0.02))
    rng = np.random.default_rng(2)
    sharp = {name: rng.normal(0.035, 1e-5, 50) for name in RATIOS}
    half = {RATIOS[0]: rng.uniform(0.02, 0.06, 50), RATIOS[1]: rng.normal(0.035, 1e-5, 50)}
    places = {"s1": [0.25], "a1": [0.25]}
    gains = [
        float(bp.information_map(experiment, places, estimator=variant)["information_gain"][0, 0])
        for variant in (
            estimator,
            type(estimator)(**(sizes(estimator) | {"after": half})),
            type(estimator)(**(sizes(estimator) | {"after": sharp})),
        )
    ]
    assert gains[0] > gains[1] + 0.2 and gains[1] > gains[2]
    assert abs(gains[2]) < 1e-3


def test_nominal_values_are_the_means_after_the_measurement():
    experiment = bar.placed(0.25, 0.3, None)
    rng = np.random.default_rng(2)
    after = {name: rng.uniform(0.02, 0.03, 50) for name in RATIOS}
    estimator = information.KernelGain(draws=64, placement_draws=64, after=after)
    means = {name: float(values.mean()) for name, values in after.items()}
    places = {"s1": [0.25], "a1": [0.25]}
    learnt = bp.information_map(experiment, places, estimator=estimator)
    explicit = bp.information_map(experiment, places, estimator=estimator, nominal=means)
    shifted = bp.information_map(
        experiment, places, estimator=estimator, nominal={RATIOS[1]: 0.021}
    )
    assert float(learnt["information_gain"][0, 0]) == pytest.approx(
        float(explicit["information_gain"][0, 0]), rel=1e-9
    )
    assert abs(float(learnt["information_gain"][0, 0] - shifted["information_gain"][0, 0])) > 0.01


def sizes(estimator):
    return {name: value for name, value in estimator.settings().items() if name != "estimator"}


def test_draws_that_lack_a_parameter_are_refused():
    experiment = bar.placed(0.25, 0.3, bp.noise.Gaussian(0.05))
    estimator = information.KernelGain(after={RATIOS[0]: np.ones(4)})
    with pytest.raises(ValueError, match=r"Draws of .*ratio.1 were given, but .*ratio.2 as"):
        estimator.plan(experiment, 0)


def test_one_explanation_is_not_told_apart(linear):
    _, explanations = alternatives(linear)
    with pytest.raises(ValueError, match=r"Separation was given 0; at least two explanations"):
        information.Separation(explanations[:1])


def test_separation_needs_the_output_error(linear):
    _, explanations = alternatives(linear)
    silent = bar.placed(0.25, 0.3, None)
    with pytest.raises(ValueError, match=r"information.Separation was given .*noise=None"):
        information.Separation(explanations).plan(silent, 0)
