"""How like records are to responses of a structure of unknown errors, gains and polarities."""

import numpy as np
from jaxtyping import Float, Shaped
from scipy.special import logsumexp

from .mistakes import Frequency, Mistake, Model, Records

LEAST_ERROR = 0.01
"""Least relative error of an amplitude, and of a phase [rad], that a model may have."""

REVERSED = 0.05
"""Prior probability that the polarity of a pair is reversed."""

_PHASE_ERRORS = np.geomspace(LEAST_ERROR, 100 * np.pi, 40)
"""Scales of the error of a phase [rad], the last of which tells nothing of it."""

OfPairs = Float[np.ndarray, "*draw pair"]


def log_likelihoods(
    frf: Records, frequency: Frequency, model: Model, mistake: Mistake, has_phase: bool
) -> Float[np.ndarray, "draw pair"]:
    """Logarithm of the probability of each record, if a mistake was made of each response.

    Errors of log amplitude and of phase follow Laplace's distribution with scales of their own,
    over which the probability is integrated. A gain is the median of the former.
    """
    size = mistake.log_size(frf, model, frequency)
    apart = size - np.log(np.abs(model))
    apart -= np.median(apart, axis=-1, keepdims=True)
    likelihood = _of_size(frf, apart, mistake.log_slope(size))
    return likelihood + _of_phase(frf, model, mistake) if has_phase else likelihood


def like_nothing(frf: Records, frequency: Frequency, has_phase: bool) -> Float[np.ndarray, "pair"]:
    """Logarithm of the probability of each record that is a power of the frequency and chance."""
    size, line = np.log(np.abs(frf)), np.log(frequency) - np.log(frequency).mean()
    apart = size - size.mean(axis=-1, keepdims=True)
    apart -= np.outer(apart @ line / (line @ line), line)
    likelihood = _of_size(frf, apart, np.zeros_like(apart))
    of_phase = -_independent(frf / np.abs(frf)) * np.log(2 * np.pi) * _knows_phase(frf)
    return likelihood + of_phase if has_phase else likelihood


def _of_size(frf: Records, apart: np.ndarray, slope: np.ndarray) -> OfPairs:
    error = np.maximum(np.abs(apart).mean(axis=-1), LEAST_ERROR)
    likelihood = _independent(np.log(np.abs(frf))) * (slope.mean(axis=-1) - np.log(error))
    return np.where(np.isnan(likelihood), -np.inf, likelihood)


def _of_phase(frf: Records, model: Model, mistake: Mistake) -> OfPairs:
    """Logarithm of the probability of the phases, whatever polarity and error are; 0 of none."""
    count = _independent(frf / np.abs(frf))
    polarities = (1, 1 - REVERSED), (-1, REVERSED)
    likelihood = np.logaddexp(
        *(
            np.log(prior) + _of_error(frf, mistake.phase(np.angle(sign * model)), count)
            for sign, prior in polarities
        )
    )
    return np.asarray(likelihood * _knows_phase(frf))


def _of_error(frf: Records, phase: np.ndarray, count: Float[np.ndarray, "pair"]) -> OfPairs:
    """Logarithm of the probability of phases about others, over the scales of their error."""
    apart = np.abs(np.angle(frf * np.exp(-1j * phase))).mean(axis=-1)[..., None]
    size = -2 * _PHASE_ERRORS * np.expm1(-np.pi / _PHASE_ERRORS)
    of_scales = count[:, None] * (-apart / _PHASE_ERRORS - np.log(size))
    return np.asarray(logsumexp(of_scales, axis=-1) - np.log(_PHASE_ERRORS.size))


def _knows_phase(frf: Records) -> Shaped[np.ndarray, "pair"]:
    return np.any(frf.imag, axis=-1)


def _independent(values: Shaped[np.ndarray, "pair frequency"]) -> Float[np.ndarray, "pair"]:
    """Number of random values whose path is as long, over the mean distance of two of them.

    Lines of one resonance have much in common: they count as few as the record turns.
    """
    path = np.abs(np.diff(values)).sum(axis=-1)
    others = np.random.default_rng(0).permutation(values, axis=-1)
    return np.asarray(
        path / np.maximum(np.abs(values - others).mean(axis=-1), np.finfo(float).tiny)
    )
