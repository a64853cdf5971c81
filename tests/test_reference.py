"""The numbers of the checked reference for section 5 of the paper, at the paper's sizes."""

import jax
import numpy as np
import pytest
from scipy.special import logsumexp

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.progress import no_progress
from bayes_placement.design.information import from_prior_draws
from bayes_placement.inference.estimates import Weighting, figures
from bayes_placement.inference.unconstrained import UnconstrainedModel
from models import bar

P1, P2, P3, P4 = (0.50, 0.50), (0.25, 0.25), (0.75, 0.25), (0.50, 0.25)
BOTH, FIRST, SECOND = (bar.PRIOR, bar.PRIOR), (bar.PRIOR, 0.04), (0.04, bar.PRIOR)

# kernel, unknown ratios, places, then mean and standard deviation over seeds of: KL, mean and
# coefficient of variation of the first ratio, and of the second, effective sample size. A mean
# without a spread of its own has the coefficient of variation over the root of the sample size.
KDE_TABLE = [
    ("soize", BOTH, P2, (2.855, 0.090), (0.0400, 0.242, 0.018), (0.0397, 0.0151, 0.0010), 48),
    ("soize", BOTH, P3, (2.929, 0.092), (0.0377, 0.261, 0.018), (0.0395, 0.0143, 0.0011), 44),
    ("soize", BOTH, P1, (2.172, 0.058), (0.0393, 0.0284, 0.0016), (0.0407, 0.282, 0.015), 98),
    ("soize", BOTH, P4, (0.190, 0.009), (0.0389, 0.245, 0.007), (0.0455, 0.232, 0.005), 715),
    ("soize", FIRST, P1, (2.196, 0.048), (0.0393, 0.0286, 0.0021), None, 95),
    ("soize", FIRST, P2, (0.053, 0.005), (0.0403, 0.243, 0.006), None, 909),
    ("soize", SECOND, P2, (2.848, 0.089), None, (0.0396, 0.0153, 0.0008), 49),
    ("soize", SECOND, P1, (0.000, 0.0005), None, (0.0402, 0.2845, 0.006), 999),
    ("silverman", BOTH, P2, (2.680, 0.087), (0.0403, 0.250, 0.018), (0.0398, 0.0175, 0.0010), 57),
    ("silverman", BOTH, P1, (2.019, 0.057), (0.0395, 0.0329, 0.0016), (0.0407, 0.282, 0.014), 114),
    ("silverman", FIRST, P1, (2.035, 0.051), (0.0395, 0.0334, 0.0022), None, 111),
    ("silverman", SECOND, P2, (2.684, 0.073), None, (0.0398, 0.0180, 0.0008), 58),
]  # fmt: skip

LONG, LONGEST = [pytest.mark.long], [pytest.mark.long, pytest.mark.longest]
# Each kernel has a row by default, each set of unknowns one that is not longest.
KDE_MARKS = {0: [], 8: []} | dict.fromkeys((1, 2, 3, 5, 7, 9, 10, 11), LONGEST)
KDE_ROWS = [
    pytest.param(*row, marks=KDE_MARKS.get(number, LONG)) for number, row in enumerate(KDE_TABLE)
]

# sigma, places, then mean and coefficient of variation of each ratio, KL, log evidence.
EXACT_TABLE = [
    (0.05, P2, (0.040452, 0.27688, 0.040363, 0.16065, 0.4071, 17.7560)),
    (0.05, P1, (0.039689, 0.27471, 0.040139, 0.28783, 0.0087, 18.6788)),
    (0.05, (0.30, 0.70), (0.038978, 0.28618, 0.039765, 0.16656, 0.3907, 18.4533)),
    (0.02, P2, (0.039528, 0.24154, 0.040006, 0.06489, 1.3873, 24.3053)),
    (0.02, P1, (0.039093, 0.21207, 0.040092, 0.28776, 0.1815, 26.4758)),
    (0.02, (0.30, 0.70), (0.037125, 0.25514, 0.039713, 0.06790, 1.3731, 25.1947)),
    (0.01, P2, (0.039385, 0.15373, 0.039983, 0.03240, 2.4862, 28.9118)),
    (0.01, P1, (0.039610, 0.11574, 0.040040, 0.28778, 0.7544, 32.0588)),
    (0.01, (0.30, 0.70), (0.037468, 0.17092, 0.039846, 0.03395, 2.3958, 29.8493)),
]
# Each noise level and each placement once by default.
EXACT_ROWS = [
    pytest.param(*row, marks=[] if number in (0, 4, 8) else LONGEST)
    for number, row in enumerate(EXACT_TABLE)
]


SEEDS, REFERENCE_SEEDS = 5, 20


def kde_runs(experiment, marginal):
    """Likelihoods and values of 1000 draws from the prior, for several seeds."""
    z = np.asarray(experiment.data(experiment.nominal_measurement()).z)
    priors = priors_of(experiment, marginal)
    prior = UnconstrainedModel(lambda: None, priors)
    for key in jax.random.split(jax.random.PRNGKey(1), SEEDS):
        vectors = prior.sample_prior(key, 1000)
        likelihood = compiled(likelihoods)(experiment, marginal, z, key, vectors)
        yield np.asarray(likelihood), compiled(values_of)(priors, vectors)


def priors_of(experiment, marginal):
    return {unknown.name: unknown.distribution for unknown in marginal.sampled(experiment)}


def likelihoods(experiment, marginal, z, key, vectors):
    data = bp.noise.Data(z, np.ones(z.shape, dtype=bool))
    priors = priors_of(experiment, marginal)
    target = UnconstrainedModel(marginal.model(experiment, data, key), priors)
    return jax.lax.map(target.log_likelihood, vectors, batch_size=250)


def values_of(priors, vectors):
    return jax.vmap(UnconstrainedModel(lambda: None, priors).constrain)(vectors)


@pytest.mark.parametrize(("kernel", "ratios", "places", "kl", "first", "second", "ess"), KDE_ROWS)
def test_kde_table(kernel, ratios, places, kl, first, second, ess):
    experiment = bar.placed(*places, noise=None, structure=bar.bar(*ratios))
    runs = []
    for likelihood, values in kde_runs(
        experiment, bp.marginals.KDE(placement_draws=800, kernel=kernel)
    ):
        log_weight = likelihood - logsumexp(likelihood)
        weighting = Weighting(log_weight[None])
        rows = {name: figures(np.asarray(v)[None], weighting) for name, v in values.items()}
        runs.append((from_prior_draws(likelihood).kl, rows))
    # Both means, over our seeds and over those of the table, have an error.
    errors = 4 * np.sqrt(1 / SEEDS + 1 / REFERENCE_SEEDS)
    assert abs(np.mean([divergence for divergence, _ in runs]) - kl[0]) < errors * kl[1]
    for number, expected in enumerate((first, second), start=1):
        if expected is not None:
            mean, variation, spread = expected
            ratio_rows = [rows[f"structure.damping.ratio.{number}"] for _, rows in runs]
            assert abs(np.mean([row.cv for row in ratio_rows]) - variation) < errors * spread
            within = errors * mean * variation / np.sqrt(ess)
            assert abs(np.mean([row.mean for row in ratio_rows]) - mean) < within
            assert np.mean([row.ess for row in ratio_rows]) == pytest.approx(ess, rel=0.25)


@pytest.mark.parametrize(("sigma", "places", "expected"), EXACT_ROWS)
def test_exact_table(sigma, places, expected):
    experiment = bar.placed(*places, bp.noise.Gaussian(sigma))
    marginal = bp.marginals.Quadrature(nodes=48)
    data = experiment.data(experiment.nominal_measurement())
    priors = {unknown.name: unknown.distribution for unknown in marginal.sampled(experiment)}
    target = UnconstrainedModel(marginal.model(experiment, data, jax.random.PRNGKey(0)), priors)
    draws = bp.engines.Grid(nodes=24).run(target, jax.random.PRNGKey(0), no_progress)
    weighting = Weighting(np.asarray(draws.log_weight), exact=True)
    values = jax.jit(jax.vmap(jax.vmap(target.constrain)))(draws.position)
    first, second = (figures(np.asarray(values[n]), weighting) for n in sorted(values))
    likelihood = np.asarray(draws.log_likelihood).ravel()
    prior_weight = np.asarray(draws.log_weight).ravel() - likelihood + draws.log_evidence
    kl = from_prior_draws(likelihood, prior_weight).kl
    got = [first.mean, first.cv, second.mean, second.cv, kl, draws.log_evidence]
    np.testing.assert_allclose(got, expected, atol=1e-4, rtol=0)
