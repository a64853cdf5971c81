"""Score test and screening of effects whose strength is a vector, such as modes above the band."""

import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.stats import kstest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement.criticism.missing._hypotheses import null_hypothesis, with_errors
from bayes_placement.criticism.missing._predicted_odds import _ErroneousModel
from bayes_placement.criticism.missing._scanned_candidates import fitted, scanned
from bayes_placement.criticism.missing._suspicion import suspicion
from bayes_placement.inference.engines.levenberg_marquardt import minimise
from tests.criticism.missing.test_predicted_odds import SIZES
from tests.criticism.small import TRUTH, experiment, measured

SEEDS = range(40)
KNOWN = {name: value for name, value in TRUTH.items() if "damping" not in name}
VECTOR = dist.Normal(np.zeros((2, 1)), 1e-8).to_event(2)


def null_of(setup, measurement):
    return null_hypothesis(setup, setup.data(measurement))


def scored(candidate, measurement):
    """Suspicion of one candidate on the bar of which only the damping is unknown."""
    null = null_of(experiment().fix(KNOWN), measurement)
    return suspicion(null, [*scanned([(null, candidate)], lambda: None)])


@pytest.fixture(scope="module")
def by_chance():
    candidate = effects.residual_modes(VECTOR)
    return [scored(candidate, measured(seed=seed)) for seed in SEEDS]


@pytest.mark.long
def test_scores_of_components_are_those_of_chance_where_nothing_is_missing(by_chance):
    """Of 40 seeds: Kolmogorov's distance is 0.30, and the mean off by 0.15, once in 1000 times."""
    assert all(len(rows) == 2 for rows in by_chance)
    p_values = [rows["p_value"].iloc[0] for rows in by_chance]
    scores = np.concatenate([rows["score"] for rows in by_chance])
    assert kstest(p_values, "uniform").statistic < 0.30
    assert kstest(scores, "norm").pvalue > 1e-3
    assert np.mean(p_values) == pytest.approx(0.5, abs=3.3 / np.sqrt(12 * len(SEEDS)))


def test_modes_above_the_band_are_suspect_in_their_channel_and_with_their_sign():
    hidden = effects.residual_modes(np.array([[0.0], [-1e-10]]))
    rows = scored(effects.residual_modes(VECTOR), measured(hidden, seed=1))
    assert rows["p_value"].iloc[0] < 1e-6
    assert rows["score"].iloc[1] == -rows["score"].abs().max()
    assert abs(rows["score"].iloc[0]) < 5


class Negligible(effects.residual_modes):
    """A flexibility whose change of the response is that of rounding."""

    name: str = "negligible"

    def added(self, omega):
        return 1e-13 * effects.residual_modes(self.flexibility).added(omega)


@pytest.mark.parametrize("strength", [VECTOR, dist.Normal(0.0, 1e-8)])
def test_what_changes_no_more_than_rounding_has_no_score(strength):
    assert scored(Negligible(strength, name="negligible"), measured(seed=1)).empty


def test_a_vector_is_as_promising_beside_a_model_error_as_a_fit_of_it_gains():
    """At the sizes of the errors without it: no place, and residuals nearly linear in it."""
    hidden = effects.residual_modes(np.array([[1e-9], [-2e-9]]))
    exact = null_of(experiment(), measured(hidden, seed=5))
    null = with_errors(
        exact, experiment().with_model_error(bp.model_error.Embedded(**SIZES)).model_error
    )
    (candidate,) = scanned([(exact, effects.residual_modes(VECTOR))], lambda: None)
    model = _ErroneousModel(null)
    problem = model.problem(fitted(candidate))
    start = null.point_in(problem)[None]
    objective = problem.squares.objective()
    _, normal = minimise(objective, start, steps=60)
    gained = float(objective.cost(start)[0] - normal.cost[0])
    assert gained > 10
    predicted = model.log_evidence_gained(fitted(candidate), problem)
    assert predicted == pytest.approx(gained, rel=0.1, abs=2)
