"""Information gains: the paper's numbers, exact integrals, a linear experiment in closed form."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import information
from bayes_placement.design.information.estimator import jackknife_error, placement_distributions
from bayes_placement.design.information.kernel_gain import _factorise
from bayes_placement.experiment.noise import Data
from bayes_placement.inference.marginals.quadrature import NestedQuadrature, nested_nodes
from models import bar
from tests.design.information.linear import FORMS, SCALES, SIGMA, linear_experiment
from tests.test_reference import BOTH, EXACT_TABLE, FIRST, KDE_TABLE, P1, P2, P4, SECOND

SMALL_ERROR = 0.02
RATIOS = ("structure.damping.ratio.1", "structure.damping.ratio.2")
TABLE = {(kernel, ratios, places): kl for kernel, ratios, places, kl, *_ in KDE_TABLE}

FURTHER = [pytest.mark.long, pytest.mark.longest]


def estimated(estimator, experiment, seed=0, **nominal):
    plan = estimator.plan(experiment, seed)
    values = experiment.nominal_values() | nominal
    gain = jax.jit(lambda: plan(experiment, values))()
    return float(gain.estimate), float(jackknife_error(np.asarray(gain.jackknife)))


@pytest.mark.parametrize(
    ("kernel", "ratios", "places", "points"),
    [
        ("soize", BOTH, P1, "plain"),
        ("silverman", SECOND, P2, "sobol"),
        pytest.param("soize", BOTH, P2, "sobol", marks=pytest.mark.long),
        pytest.param("soize", BOTH, P4, "sobol", marks=FURTHER),
        pytest.param("soize", FIRST, P1, "sobol", marks=FURTHER),
    ],
)
def test_kde_has_the_numbers_of_the_paper(kernel, ratios, places, points):
    experiment = bar.placed(*places, noise=None, structure=bar.bar(*ratios))
    gain, error = estimated(information.KernelGain(kernel=kernel, sampling=points), experiment)
    mean, spread = TABLE[kernel, ratios, places]
    assert 0 < error < 2 * spread
    assert abs(gain - mean) < 4 * np.hypot(error, spread / np.sqrt(20))


def test_products_of_modes_are_the_responses():
    """The short way in single precision beside the long one in double."""
    experiment = bar.placed(*P2, noise=bp.noise.Gaussian(0.02))
    estimator = information.KernelGain(draws=64, placement_draws=100)
    short, _ = estimated(estimator, experiment)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(information.kernel_gain, "_factorise", lambda _: False)
        long, _ = estimated(estimator, experiment)
    assert short == pytest.approx(long, rel=1e-4)


def test_products_serve_all_force_levels_of_a_linear_structure():
    base = bar.placed(*P2, noise=bp.noise.Gaussian(0.02))
    experiment = bp.Experiment(
        base.structure,
        sensors=list(base.sensor.values()),
        actuators=list(base.actuator.values()),
        frequency=base.frequency,
        observe=base.observe,
        noise=base.noise,
        force_levels=[0.1, 1.0],
    )
    assert _factorise(experiment)
    estimator = information.KernelGain(draws=64, placement_draws=100)
    by_products, _ = estimated(estimator, experiment)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(information.kernel_gain, "_factorise", lambda _: False)
        by_responses, _ = estimated(estimator, experiment)
    assert by_products == pytest.approx(by_responses, rel=1e-4)


@pytest.mark.parametrize(
    "row", [EXACT_TABLE[5], *(pytest.param(EXACT_TABLE[n], marks=FURTHER) for n in (0, 1))]
)
def test_exact_has_the_numbers_of_the_reference(row):
    sigma, places, expected = row
    experiment = bar.placed(*places, bp.noise.Gaussian(sigma))
    gain, error = estimated(information.Exact(draws=512, nodes=32), experiment)
    assert 0 < error < 0.03
    assert abs(gain - expected[4]) < 4 * error + 1e-4


@pytest.fixture(scope="module")
def linear():
    return linear_experiment()


def closed_form():
    slopes = (SCALES[:, None] * FORMS).T / SIGMA
    return 0.5 * np.linalg.slogdet(np.eye(3) + slopes @ slopes.T)[1]


def test_the_expected_gain_of_a_linear_experiment_is_the_closed_form(linear):
    estimator = information.ExpectedGain(
        draws=2048, placement_draws=1, data_draws=512, replicates=8
    )
    gain, error = estimated(estimator, linear)
    assert error < 0.02
    assert abs(gain - closed_form()) < 3 * error


@pytest.mark.long
def test_its_bias_falls_like_one_over_the_draws(linear):
    sizes, biases, errors = [8, 16, 32], [], []
    for size in sizes:
        estimator = information.ExpectedGain(
            draws=size, placement_draws=1, data_draws=256, sampling="plain", replicates=64
        )
        gain, error = estimated(estimator, linear)
        biases.append(gain - closed_form())
        errors.append(error)
    assert biases[0] > 10 * errors[0]
    # Four times the draws: a fourth of the bias, but for what is of second order.
    ratio = biases[0] / biases[2]
    assert ratio == pytest.approx(4.0, abs=3 * ratio * errors[2] / biases[2] + 1.0)


def exact_divergences(experiment, count):
    """Divergence for data that the prior predicts, all integrals by Gauss quadrature."""
    priors = placement_distributions(experiment)
    nodes = nested_nodes(experiment, priors, 32)
    node, weight = np.polynomial.legendre.leggauss(12)
    first, second = (axis.ravel() for axis in np.meshgrid(0.04 + 0.02 * node, 0.04 + 0.02 * node))
    log_weight = np.log(np.outer(weight / 2, weight / 2).ravel())

    @jax.jit
    def likelihoods(z):
        integrated = NestedQuadrature(Data(z, np.ones(z.shape, dtype=bool)), nodes)
        grid = {RATIOS[0]: jnp.asarray(first), RATIOS[1]: jnp.asarray(second)}
        return jax.lax.map(
            lambda values: integrated.log_likelihood(experiment.fix(values)),
            grid,
            batch_size=16,
        )

    respond = jax.jit(lambda values: experiment.fix(values).predict())
    random = np.random.default_rng(0)
    for _ in range(count):
        values = {name: random.uniform(0.02, 0.06) for name in RATIOS}
        values |= {
            name: float(random.uniform(prior.low, prior.high)) for name, prior in priors.items()
        }
        z = respond(values)
        z += SMALL_ERROR * random.standard_normal(z.shape)
        yield information.from_prior_draws(np.asarray(likelihoods(z)), log_weight).kl


@pytest.mark.long
def test_the_expected_gain_of_the_bar_is_the_mean_of_exact_divergences():
    """Placement unknown by 4 cm, which moves the outputs by thirty times their error."""
    experiment = bar.placed(*P2, bp.noise.Gaussian(SMALL_ERROR))
    exact = np.fromiter(exact_divergences(experiment, 100), float)
    truth, deviation = exact.mean(), exact.std(ddof=1) / 10
    assert deviation < 0.05 < truth / 20
    for places in (16, 64):
        gain, error = estimated(information.ExpectedGain(placement_draws=places), experiment)
        assert abs(gain - truth) < 3 * np.hypot(error, deviation)


@pytest.mark.long
def test_one_more_sensor_teaches_no_less():
    base = bar.placed(0.25, 0.25, bp.noise.Gaussian(SMALL_ERROR))
    gains = []
    for count in (1, 2):
        experiment = bp.Experiment(
            base.structure,
            sensors=[
                bp.Sensor(f"s{number}", at=bp.positions.Segment(at, within=0.04))
                for number, at in enumerate((0.25, 0.75)[:count])
            ],
            actuators=list(base.actuator.values()),
            frequency=base.frequency,
            observe=base.observe,
            noise=base.noise,
        )
        gains.append(estimated(information.ExpectedGain(placement_draws=16), experiment))
    (one_sensor, first), (two_sensors, second) = gains
    assert two_sensors - one_sensor > 3 * np.hypot(first, second)


def test_more_is_learnt_where_the_output_error_is_less(linear):
    small = information.ExpectedGain(draws=128, placement_draws=1, data_draws=128)
    coarse = eqx.tree_at(lambda tree: tree.noise, linear, bp.noise.Gaussian(10 * SIGMA))
    assert estimated(small, linear)[0] > 3 * estimated(small, coarse)[0]


def known():
    return bar.placed(*P2, bp.noise.Gaussian(0.05), structure=bar.bar(0.04, 0.04))


def certain(noise):
    uncertain = bar.placed(*P2, noise)
    places = {name: v for name, v in uncertain.nominal_values().items() if "position" in name}
    return uncertain.fix(places)


@pytest.mark.parametrize(
    ("estimator", "make", "message"),
    [
        (information.KernelGain(), known, r"no unknown parameter; at least one is needed"),
        (
            information.KernelGain(),
            lambda: certain(None),
            r"no position or angle is a distribution",
        ),
        (information.Exact(), lambda: bar.placed(*P2, None), r"noise=None; the output error"),
        (information.ExpectedGain(), lambda: certain(None), r"ExpectedGain was given .*noise=None"),
        (
            information.Exact(),
            lambda: bar.placed(*P2, bp.noise.Gaussian(0.01)) + bp.effects.gain_error("s1", 0.1),
            r"information.Exact was given an experiment with the effect \"gain_error\" on its inst",
        ),
        (
            information.Exact(),
            lambda: bar.placed(*P2, bp.noise.Gaussian(dist.HalfNormal(0.1))),
            r"noise.Gaussian of unknown level",
        ),
        (
            information.KernelGain(sampling="halton"),
            lambda: bar.placed(*P2, None),
            r"sampling='halton' .*'sobol' or 'plain'",
        ),
        (
            information.KernelGain(draws=3),
            lambda: bar.placed(*P2, None),
            r"draws=3 in replicates=4 were given; at least two",
        ),
    ],
)
def test_what_cannot_be_estimated_is_refused(estimator, make, message):
    with pytest.raises(ValueError, match=message):
        estimator.plan(make(), 0)


def test_a_kernel_that_does_not_exist_is_refused():
    with pytest.raises(ValueError, match=r"no kernel 'cosine'. The kernels are soize and"):
        information.KernelGain(kernel="cosine")
