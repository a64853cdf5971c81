"""Sizes of errors by the evidence: what falls behind a rival is given up, and nothing else."""

import equinox as eqx
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.inference.engines import empirical_bayes
from bayes_placement.inference.engines.empirical_bayes import Rival, fitted_with_sizes
from bayes_placement.inference.engines.levenberg_marquardt import laplace
from bayes_placement.inference.residuals import Problem
from tests.inference.engines.test_mode_with_sizes import case  # noqa: F401  a fixture


@pytest.fixture(scope="module")
def problem(case):  # noqa: F811
    experiment, measurement = case
    return Problem(experiment, experiment.data(measurement))


@pytest.fixture
def fits(monkeypatch):
    """Relative error of each descent, in their order."""
    softened, fit = [], empirical_bayes._fit

    def counted(problem, starts, relative_error=0.0, *settings, **named):
        softened.append(relative_error)
        return fit(problem, starts, relative_error, *settings, **named)

    monkeypatch.setattr(empirical_bayes, "_fit", counted)
    return softened


def fitted(problem, rival=Rival()):  # noqa: B008
    return fitted_with_sizes(problem, np.zeros((1, problem.dimension)), rival=rival)


@pytest.fixture(scope="module")
def alone(problem):
    return fitted(problem)


def test_the_sizes_are_those_of_the_errors(alone):
    (size,) = alone.problem.sizes.values()
    assert size == pytest.approx(0.01, rel=0.3)


def test_beside_itself_a_fit_is_not_given_up(problem, alone):
    assert fitted(problem, alone.as_rival).fit.log_evidence == alone.fit.log_evidence


def test_what_does_not_follow_the_data_to_a_tenth_is_given_up_at_once(problem, alone, fits):
    far = alone.as_rival._replace(
        with_small_error=alone.as_rival.with_small_error + 1.01 * problem.count
    )
    given_up = fitted(problem, far)
    assert fits == [0.3, 0.1, 0.0]
    assert given_up.fit.log_evidence < alone.fit.log_evidence
    near = alone.as_rival._replace(
        with_small_error=alone.as_rival.with_small_error + 0.99 * problem.count
    )
    assert fitted(problem, near).fit.log_evidence == alone.fit.log_evidence


def test_what_begins_far_behind_is_given_up_before_its_sizes_are_sought(problem, alone, fits):
    given_up = fitted(problem, Rival(early=alone.as_rival.early + 0.11 * problem.count))
    assert fits == [*empirical_bayes.DECREASING_ERRORS, 0.0]
    assert given_up.as_rival.early == alone.as_rival.early


def test_what_gains_too_little_to_reach_a_rival_is_given_up(problem, alone, fits, monkeypatch):
    monkeypatch.setattr(empirical_bayes, "SETTLED", -np.inf)
    fitted(problem)
    assert fits.count(0.0) == 2 + empirical_bayes.ROUNDS
    fits.clear()
    fitted(problem, Rival(evidence=alone.fit.log_evidence + 1e6))
    assert fits.count(0.0) == 3  # two of the first sizes, one of others


@pytest.fixture(scope="module")
def missed(case):  # noqa: F811
    """Noise stated as a tenth of what it is: evidence counts a hundred times too much."""
    experiment, measurement = case
    experiment = eqx.tree_at(lambda tree: tree.noise, experiment, bp.noise.Relative(0.0005))
    return Problem(experiment, experiment.data(measurement))


@pytest.fixture
def gains(monkeypatch):
    """Gain at which each descent ends, in their order."""
    noted, descend = [], empirical_bayes.minimise

    def noting(objective, starts, *, gain, **settings):
        noted.append(gain)
        return descend(objective, starts, gain=gain, **settings)

    monkeypatch.setattr(empirical_bayes, "minimise", noting)
    return noted


def test_what_misses_the_data_in_spite_of_its_errors_is_fitted_less_exactly(
    missed, gains, monkeypatch
):
    sooner = fitted(missed)
    chi2 = sooner.fit.squares / missed.count
    assert chi2 > 10
    assert gains.count(empirical_bayes.ALMOST) >= 1
    monkeypatch.setattr(empirical_bayes, "_may_be_right", lambda problem, fit: True)
    gains.clear()
    exact = fitted(missed)
    assert set(gains) == {empirical_bayes.GAIN}
    assert abs(exact.fit.log_evidence - sooner.fit.log_evidence) < chi2


def test_gains_of_evidence_count_by_the_misfit(missed, fits, monkeypatch):
    """The first gain is half of what is asked in units of chi2, and far more than asked plainly."""
    evidence, sized = [], empirical_bayes._sized

    def noted(problem, fit):
        evidence.append(sized(problem, fit))
        return evidence[-1]

    monkeypatch.setattr(empirical_bayes, "_sized", noted)
    fitted(missed)
    first, second, *_ = (each.fit.log_evidence for each in evidence)
    chi2 = evidence[1].fit.squares / missed.count
    fits.clear()
    monkeypatch.setattr(empirical_bayes, "SETTLED", 2 * (second - first) / chi2)
    fitted(missed)
    assert fits.count(0.0) == 3  # two of the first sizes, one of others


def test_what_follows_the_data_is_fitted_to_the_end(problem, alone, gains, monkeypatch):
    monkeypatch.setattr(empirical_bayes, "ALMOST", np.inf)
    assert fitted(problem).fit.log_evidence == alone.fit.log_evidence
    assert set(gains) == {empirical_bayes.GAIN}


def test_sizes_of_a_linear_model_are_the_same_from_any_point(problem, alone):
    """From a descent cut short, where the data still pull, as from its end."""
    curvature = np.linalg.inv(alone.fit.gaussian.covariance)
    apart = np.random.default_rng(0).normal(size=problem.dimension)
    ends = alone.fit._replace(gradient=np.zeros(problem.dimension))
    short = ends._replace(point=ends.point + apart, gradient=curvature @ apart)
    settled, begun = (empirical_bayes._better(alone.problem, fit) for fit in (ends, short))
    assert begun == pytest.approx(settled, rel=1e-4)
    unpulled = empirical_bayes._better(alone.problem, short._replace(gradient=ends.gradient))
    assert unpulled != pytest.approx(settled, rel=1e-2)


def test_a_fit_without_a_finite_curvature_leaves_the_sizes_as_they_are(alone):
    shapeless = laplace(alone.fit.point, np.full((alone.problem.dimension,) * 2, np.nan))
    fit = alone.fit._replace(gaussian=shapeless)
    assert empirical_bayes._better(alone.problem, fit) == alone.problem.sizes
