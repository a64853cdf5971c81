"""Every engine on posteriors in closed form, and its warnings where it fails."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import numpyro
import numpyro.distributions as dist
import pytest
from scipy.special import gammaln

from bayes_placement import engines
from bayes_placement._shared.progress import no_progress
from bayes_placement.inference.engines import nuts
from bayes_placement.inference.engines.importance import pareto_k
from bayes_placement.inference.engines.smc import _start, evidence_error
from bayes_placement.inference.unconstrained import UnconstrainedModel
from tests.benchmarks.posteriordb_models import posterior

# y = a + 2 b + noise and y' = b + noise, with Gaussian priors of different means and scales: the
# posterior is Gaussian, correlated, and symmetric in nothing.
PRIOR_MEAN, PRIOR_SD = np.array([1.0, -2.0]), np.array([0.7, 1.5])
DESIGN, NOISE, MEASURED = (
    np.array([[1.0, 2.0], [0.0, 1.0]]),
    np.array([0.4, 0.9]),
    np.array([0.3, 1.1]),
)
PRECISION = np.diag(PRIOR_SD**-2.0) + DESIGN.T @ np.diag(NOISE**-2.0) @ DESIGN
COVARIANCE = np.linalg.inv(PRECISION)
MEAN = COVARIANCE @ (PRIOR_MEAN / PRIOR_SD**2 + DESIGN.T @ (MEASURED / NOISE**2))
MARGINAL = np.diag(NOISE**2) + DESIGN @ np.diag(PRIOR_SD**2) @ DESIGN.T
RESIDUAL = MEASURED - DESIGN @ PRIOR_MEAN
LOG_EVIDENCE = -0.5 * (
    RESIDUAL @ np.linalg.solve(MARGINAL, RESIDUAL) + np.linalg.slogdet(2 * np.pi * MARGINAL)[1]
)
PRIORS = {
    "a": dist.Normal(PRIOR_MEAN[0], PRIOR_SD[0]),
    "b": dist.Normal(PRIOR_MEAN[1], PRIOR_SD[1]),
}


def linear_gaussian():
    values = jnp.stack([numpyro.sample(name, prior) for name, prior in PRIORS.items()])
    numpyro.sample("y", dist.Normal(DESIGN @ values, NOISE), obs=jnp.asarray(MEASURED))


def two_modes():
    x = numpyro.sample("x", dist.Uniform(-3.0, 5.0))
    numpyro.sample("y", dist.Normal(x**2, 0.05), obs=jnp.asarray(4.0))


TWO_MODES = {"x": dist.Uniform(-3.0, 5.0)}


def run(engine, model=linear_gaussian, priors=PRIORS, key=0, **options):
    target = UnconstrainedModel(model, priors, **options)
    return target, engine.run(target, jax.random.PRNGKey(key), no_progress)


def values(target, draws):
    """Values of both unknowns [chain, draw, unknown]."""
    named = jax.jit(jax.vmap(jax.vmap(target.constrain)))(jnp.asarray(draws.position))
    return np.stack([named[name] for name in PRIORS], axis=-1)


def weights(draws):
    shape = draws.position.shape[:2]
    equal = np.full(shape, 1 / np.prod(shape))
    return equal if draws.log_weight is None else np.exp(np.asarray(draws.log_weight))


# And as how many independent draws theirs count at least.
ENGINES = {
    "importance": (engines.Importance(draws=20_000), 400),
    "grid": (engines.Grid(nodes=48), 1e8),
    "map": (engines.MAP(starts=4, draws=20_000), 20_000),
    "nuts": (engines.NUTS(warmup=300, draws=1000), 1000),
    "smc": (engines.SMC(particles=2000), 1500),
}


@functools.cache
def gaussian(name):
    """What an engine finds, and the shares of its work that it told."""
    shares = []
    target = UnconstrainedModel(linear_gaussian, PRIORS)
    draws = ENGINES[name][0].run(target, jax.random.PRNGKey(0), shares.append)
    return target, draws, shares


@pytest.mark.parametrize("name", ENGINES)
def test_a_gaussian_posterior_is_found(name):
    effective = ENGINES[name][1]
    target, draws, _ = gaussian(name)
    weight, position = weights(draws)[..., None], values(target, draws)
    mean = np.sum(weight * position, axis=(0, 1))
    sd = np.sqrt(np.sum(weight * (position - mean) ** 2, axis=(0, 1)))
    exact = np.sqrt(np.diag(COVARIANCE))
    tolerance = 5 / np.sqrt(effective) + 1e-4
    np.testing.assert_array_less(np.abs(mean - MEAN) / exact, tolerance)
    np.testing.assert_array_less(np.abs(sd / exact - 1), tolerance)


@pytest.mark.parametrize(("name", "error"), [("grid", 1e-4), ("map", 1e-6)])
def test_an_exact_evidence_is_exact(name, error):
    assert abs(gaussian(name)[1].log_evidence - LOG_EVIDENCE) < error


@pytest.mark.parametrize(
    ("engine", "runs"),
    [(engines.Importance(draws=2000), 40), (engines.SMC(particles=200), 20)],
    ids=["importance", "smc"],
)
def test_an_estimated_evidence_knows_its_error(engine, runs):
    results = [run(engine, key=key)[1] for key in range(runs)]
    deviation = [
        (result.log_evidence - LOG_EVIDENCE) / result.log_evidence_error for result in results
    ]
    assert np.all(np.abs(deviation) < 5)
    # Neither too small nor too large: so many runs show their scatter to 11 and to 16 %.
    assert 0.6 < np.sqrt(np.mean(np.square(deviation))) < 1.6


@pytest.mark.parametrize(
    "engine",
    [engines.Importance(draws=50), engines.NUTS(warmup=50, draws=50), engines.SMC(particles=80)],
    ids=lambda engine: type(engine).__name__,
)
def test_the_same_key_gives_the_same_draws(engine):
    first, second, other = (run(engine, key=key)[1].position for key in (1, 1, 2))
    np.testing.assert_array_equal(first, second)
    assert np.any(np.asarray(first) != np.asarray(other))


def test_the_genealogy_gives_an_error_where_populations_agree_by_chance():
    # 1 - (4 / 3) (1 - 6 / 16) = 1 / 6 for each of two populations of four, by Lee and Whiteley.
    lineage = np.array([[0, 0, 1, 2], [4, 5, 6, 6]])
    error = evidence_error(np.zeros(2), lineage, [1, 1])
    assert error == pytest.approx(np.sqrt(1 / 6 / 2), rel=1e-12)


def test_smc_weighs_separate_modes():
    # x = -2 and x = 2 explain the data alike, and the prior holds both.
    target, draws = run(engines.SMC(particles=2000), two_modes, TWO_MODES)
    x = np.asarray(jax.vmap(jax.vmap(target.constrain))(draws.position)["x"])
    assert abs(np.mean(x > 0) - 0.5) < 0.1
    assert np.all(np.abs(np.abs(x) - 2.0) < 0.1)


def test_nuts_says_that_it_does_not_hop():
    _, draws = run(engines.NUTS(warmup=200, draws=200), two_modes, TWO_MODES, key=3)
    assert any("have not mixed: R-hat" in warning for warning in draws.warnings)


def test_nuts_stops_with_words_where_chains_cannot_mix():
    # Of four chains some start in the mode at -2, others in that at 2, and none ever hops.
    _, draws = run(engines.NUTS(warmup=1000, draws=1000), two_modes, TWO_MODES, key=0)
    (warning,) = draws.warnings
    assert "The chains were stopped after 300 of 2000 steps: they sit in separate modes" in warning
    assert "use engines.SMC()" in warning
    assert draws.position.shape == (4, 100, 1)


def test_chains_on_their_way_from_far_off_are_not_at_rest():
    random = np.random.default_rng(0)
    apart = np.array([0.0, 50.0])[:, None] + random.standard_normal((100, 2, 1))
    near = random.standard_normal((100, 2))
    far = near + [0.0, -1e200] * near  # its squares are beyond the greatest number
    assert nuts._are_apart({"lp": near, "position": apart})
    assert not nuts._are_apart({"lp": far, "position": apart})


@pytest.mark.long
@pytest.mark.longest
def test_particles_of_smc_do_not_lag_behind_a_prior_that_is_far_wider():
    model, priors, _ = posterior("mesquite-logmesquite_logvas")
    target, draws = run(engines.SMC(particles=4000), model, priors)
    level = jax.jit(jax.vmap(jax.vmap(target.constrain)))(draws.position)["sigma"]
    # With flat priors 2 / sum of squares is Gamma distributed in 1 / sigma^2, n - p - 1 degrees.
    columns = np.asarray(model.columns)
    (squares,) = np.linalg.lstsq(columns, np.asarray(model.target))[1]
    half = (columns.shape[0] - columns.shape[1] - 1) / 2
    mean = np.sqrt(squares / 2) * np.exp(gammaln(half - 0.5) - gammaln(half))
    deviation = np.sqrt(squares / 2 / (half - 1) - mean**2)
    assert abs(np.mean(level) - mean) < 0.05 * deviation


@pytest.mark.parametrize("name", ["importance", "nuts", "smc"])
def test_each_draw_comes_with_its_log_likelihood(name):
    target, draws, _ = gaussian(name)
    expected = jax.jit(jax.vmap(jax.vmap(target.log_likelihood)))(jnp.asarray(draws.position))
    np.testing.assert_allclose(draws.log_likelihood, expected, rtol=1e-9)


def test_nuts_does_not_stop_chains_that_mix():
    _, draws, _ = gaussian("nuts")
    assert draws.position.shape == (4, 1000, 2)
    assert not draws.warnings


@pytest.mark.long
def test_a_symmetry_lets_smc_switch_between_modes():
    # All particles start in one mode, whose differences lead nowhere else: only the mirror does.
    mirror = (lambda values: {"x": -values["x"]},)
    for moves, expected in (((), 0.0), (mirror, 0.5)):
        target = UnconstrainedModel(two_modes, TWO_MODES, moves)
        x = 2.0 + 1e-3 * jax.random.normal(jax.random.PRNGKey(0), (500,))
        particles = jax.vmap(target.flatten)({"x": x})
        likelihood = jax.vmap(target.log_likelihood)(particles)
        start = _start(particles, likelihood, 0)._replace(temperature=jnp.ones(()))
        engine = engines.SMC(particles=2000, moves=2)
        moved = jax.jit(lambda key, state: engine.moved(target, 500, key, state))(  # noqa: B023
            jax.random.PRNGKey(1), start
        )
        share = np.mean(jax.vmap(target.constrain)(moved.particles)["x"] < 0)
        assert abs(share - expected) <= 5 * np.sqrt(expected * (1 - expected) / 500)


@pytest.mark.long
def test_a_wrong_symmetry_biases_nothing():
    def mirror(values):
        return {"a": 2.0 - values["a"], "b": values["b"]}

    target, draws = run(engines.SMC(particles=2000), moves=(mirror,))
    deviation = (np.mean(values(target, draws), axis=(0, 1)) - MEAN) / np.sqrt(np.diag(COVARIANCE))
    assert np.all(np.abs(deviation) < 5 / np.sqrt(1500))


def test_a_grid_zooms_into_a_narrow_posterior():
    def narrow():
        x = numpyro.sample("x", dist.Uniform(0.0, 1.0))
        numpyro.sample("y", dist.Normal(x, 1e-4), obs=jnp.asarray(0.30005))

    target, draws = run(engines.Grid(nodes=24), narrow, {"x": dist.Uniform(0.0, 1.0)})
    x = np.asarray(jax.vmap(jax.vmap(target.constrain))(draws.position)["x"])
    mean = np.sum(weights(draws) * x)
    np.testing.assert_allclose(mean, 0.30005, atol=1e-7)
    np.testing.assert_allclose(np.sum(weights(draws) * (x - mean) ** 2), 1e-8, rtol=1e-3)
    np.testing.assert_allclose(draws.log_evidence, 0.0, atol=1e-3)
    assert draws.warnings == ()


def test_the_evolutionary_search_finds_the_better_of_two_modes():
    def tilted():
        x = numpyro.sample("x", dist.Uniform(-3.0, 5.0))
        numpyro.sample("y", dist.Normal(x**2 - 0.1 * x, 0.05), obs=jnp.asarray(4.3))
        numpyro.factor("tilt", 3.0 * x)

    target, draws = run(engines.MAP(search="evolutionary"), tilted, TWO_MODES)
    np.testing.assert_allclose(target.constrain(draws.mode)["x"], 2.1247, atol=1e-2)


def test_laplace_says_when_the_posterior_is_no_gaussian():
    _, draws = run(engines.MAP(), two_modes, TWO_MODES)
    assert draws.warnings == ()  # each of the two peaks by itself is near a Gaussian

    def banana():
        x = numpyro.sample("x", dist.Uniform(-3.0, 5.0))
        y = numpyro.sample("y", dist.Uniform(-30.0, 30.0))
        numpyro.sample("z", dist.Normal(y - x**2, 0.01), obs=jnp.asarray(0.0))

    _, draws = run(engines.MAP(), banana, {**TWO_MODES, "y": dist.Uniform(-30.0, 30.0)})
    assert any(
        "not near the Gaussian" in warning or "flat at its" in warning for warning in draws.warnings
    )


@pytest.mark.long
def test_laplace_says_when_the_mode_lies_in_a_corner_where_all_is_flat_alike():
    def rising():
        x = numpyro.sample("x", dist.Uniform(0.0, 1.0))
        y = numpyro.sample("y", dist.Uniform(-2.0, 5.0))
        numpyro.factor("corner", 1e4 * x + 2e4 * y)

    priors = {"x": dist.Uniform(0.0, 1.0), "y": dist.Uniform(-2.0, 5.0)}
    target, draws = run(engines.MAP(), rising, priors)
    assert any("flat at its maximum" in warning for warning in draws.warnings)
    x = jax.vmap(jax.vmap(target.constrain))(draws.position)["x"]
    assert np.mean(np.asarray(x) < 0.5) < 0.01  # none at the other edge


def test_importance_says_when_few_draws_carry_the_weight():
    _, draws = run(engines.Importance(draws=200), two_modes, TWO_MODES)
    assert any("Importance sampling is unreliable here" in warning for warning in draws.warnings)


@pytest.mark.parametrize("shape", [0.3, 0.7, 1.2])
def test_pareto_k_is_that_of_the_tail(shape):
    weights = np.random.default_rng(1).pareto(1 / shape, 100_000) + 1
    assert pareto_k(np.log(weights)) == pytest.approx(shape, abs=0.15)
    assert pareto_k(np.zeros(100)) == 0.0


def impossible():
    numpyro.sample("x", dist.Uniform(0.0, 1.0))
    numpyro.factor("y", -jnp.inf)


@pytest.mark.parametrize(
    "engine", [engines.Importance(draws=20), engines.SMC(particles=80), engines.MAP(starts=2)]
)
def test_data_that_cannot_be_are_an_error(engine):
    with pytest.raises(ValueError, match=r"[Cc]heck the units"):
        run(engine, impossible, {"x": dist.Uniform(0.0, 1.0)})


def test_a_discrete_unknown_is_an_error():
    with pytest.raises(ValueError, match="has a discrete distribution, BernoulliProbs"):
        UnconstrainedModel(linear_gaussian, {"a": dist.Bernoulli(0.5)})


def test_a_large_grid_is_an_error():
    priors = {name: dist.Uniform(0.0, 1.0) for name in "abcde"}
    with pytest.raises(ValueError, match=r"engines.Grid\(24\) over 5 unknowns has 8e\+06 nodes"):
        engines.Grid(nodes=24).run(UnconstrainedModel(linear_gaussian, priors), None, no_progress)


def test_wrong_settings_are_errors():
    with pytest.raises(ValueError, match="no search 'simplex'"):
        engines.MAP(search="simplex")
    with pytest.raises(ValueError, match="at least two populations of 20 particles"):
        engines.SMC(particles=30)


@pytest.mark.long
def test_nuts_runs_in_blocks_whatever_the_number_of_draws():
    shares = []
    target = UnconstrainedModel(linear_gaussian, PRIORS)
    draws = engines.NUTS(chains=2, warmup=50, draws=49).run(
        target, jax.random.PRNGKey(0), shares.append
    )
    assert len(shares) == 1  # one block of 99 steps, not 99 of one
    assert draws.position.shape == (2, 49, 2)
    longer_run = engines.NUTS(chains=2, warmup=50, draws=61).run(
        target, jax.random.PRNGKey(0), shares.append
    )
    assert len(shares) == 3
    # The steps are the same, however they are cut into blocks.
    np.testing.assert_allclose(longer_run.position[:, :49], draws.position, rtol=1e-9)


@pytest.mark.parametrize("name", ENGINES)
def test_progress_ends_at_one(name):
    *_, shares = gaussian(name)
    assert shares[-1] == pytest.approx(1.0)
    assert shares == sorted(shares)


def test_progress_of_a_grid_that_is_refined_never_runs_backwards():
    shares = []
    target = UnconstrainedModel(linear_gaussian, PRIORS)
    engines.Grid(nodes=12, batch=12).run(target, jax.random.PRNGKey(0), shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert shares[11] == 0.5  # the first of several levels
