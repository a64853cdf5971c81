"""Where the noise is not known, what explains a single datum is no effect: it may be an outlier."""

import dataclasses

import equinox as eqx
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.stats import norm

import bayes_placement as bp
from bayes_placement.criticism.missing import _outliers, _shared_fits
from bayes_placement.criticism.missing._cautions import cautions_of_fit
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.missing._outliers import OUTLIERS, SIZE_OF_OUTLIERS, mixture
from bayes_placement.criticism.missing._posterior_odds import explains
from bayes_placement.criticism.missing._rows import row_of
from bayes_placement.criticism.missing._unknown_noise import gain_with_outliers
from bayes_placement.experiment.noise import Noise
from bayes_placement.inference.chi2 import LEVEL
from tests.criticism.small import experiment, measured, without_coherence

ABSORBER = bp.effects.tuned_absorber(0.313, mass=0.05, frequency=330.0, damping_ratio=0.01)


def of_unknown_noise():
    noise = bp.noise.Relative(dist.LogUniform(1e-3, 0.3), dist.LogUniform(1e-4, 1.0))
    return eqx.tree_at(
        lambda tree: tree.noise,
        experiment(),
        noise,
        is_leaf=lambda leaf: isinstance(leaf, Noise),
    )


def searched(*hidden, error=0.0):
    """Search in a measurement without coherence, one datum of which is wrong by a share."""
    measurement = without_coherence(measured(*hidden, seed=4))
    frf = np.array(measurement.frf)
    frf[0, 0, 20] *= 1 + error
    candidates = bp.effects.library(of_unknown_noise(), ["tuned_absorber", "point_mass"])
    wrong = dataclasses.replace(measurement, frf=frf)
    return bp.improve(
        of_unknown_noise(), wrong, candidates=candidates, model_error=None, most_effects=1
    )


@pytest.mark.long
def test_a_single_wrong_datum_is_no_absorber_but_named():
    ledger = searched(error=0.3)
    assert ledger.verdict == ()
    (sentence,) = [words for words in ledger.words() if "outliers" in words]
    assert "s1+x at 257.1 Hz, driven at a1+x. Look" in sentence


@pytest.mark.long
@pytest.mark.longest
def test_where_no_outlier_is_possible_a_single_wrong_datum_is_an_absorber(monkeypatch):
    monkeypatch.setattr(_outliers, "OUTLIERS", 1e-300)
    _shared_fits._LAST.clear()
    assert searched(error=0.3).verdict == ("tuned_absorber",)


def test_an_absorber_that_shows_in_a_few_lines_is_named():
    ledger = searched(ABSORBER)
    assert ledger.verdict == ("tuned_absorber",)
    assert not any("outliers" in words for words in ledger.words())
    frequency = ledger.steps[-1].parameters["structure.effects.tuned_absorber.frequency"]
    assert frequency.low < 330.0 < frequency.high


def test_the_gain_is_that_of_the_mixture_at_the_best_level():
    residual = np.append(np.random.default_rng(0).standard_normal(200), 30.0)
    levels = np.linspace(0.2, 1.0, 2001)[:, None]
    density = (1 - OUTLIERS) * norm.pdf(residual, scale=levels) + OUTLIERS * norm.pdf(
        residual, scale=SIZE_OF_OUTLIERS * levels
    )
    expected = np.log(density).sum(axis=1).max() - norm.logpdf(residual).sum()
    fitted = mixture(residual, residual.size)
    assert fitted.gain == pytest.approx(expected, abs=1e-3)
    assert 1.0 < fitted.outliers < 1.5
    assert fitted.probability.argmax() == 200


def test_well_behaved_errors_gain_nothing():
    fitted = mixture(np.random.default_rng(1).standard_normal(1000), 1000)
    assert 1000 * np.log1p(-OUTLIERS) < fitted.gain < 1.0
    assert fitted.outliers < 10.0


def test_known_noise_has_no_outliers():
    known = null_hypothesis(experiment(), experiment().data(measured()))
    known.residual[0] = 50.0
    assert gain_with_outliers(known) == 0.0


def _outliers_told(hypothesis):
    return [words for words in cautions_of_fit(hypothesis) if "outliers" in words]


def test_more_outliers_than_a_few_are_a_misfit():
    measurement = without_coherence(measured())
    null = null_hypothesis(of_unknown_noise(), of_unknown_noise().data(measurement))
    assert explains(null, LEVEL) and row_of(null).p_value_of_outliers > 0.5
    null = dataclasses.replace(null)  # nothing is computed yet
    rows = null.residual.reshape(-1, 60)
    rows[0, 0] = 8.0
    assert [words[:22] for words in _outliers_told(null)] == ["Most probably outliers"]
    null = dataclasses.replace(null, problem=null.problem)
    rows = null.residual.reshape(-1, 60)
    rows[:, ::12] = 8.0  # a share of 8 %
    assert _outliers_told(null) == []
    assert row_of(null).p_value_of_outliers < LEVEL
    assert not explains(null, LEVEL)
