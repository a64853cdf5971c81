"""How like a record is to responses of a structure whose errors, gains and polarities are unknown."""

import numpy as np
from jaxtyping import Complex, Float, Shaped
from scipy.special import logsumexp

from .mistakes import Mistake, Model, Values

LEAST_ERROR = 0.01
"""Least relative error of an amplitude, and of a phase [rad], that a model may have."""

REVERSED = 0.05
"""Prior probability that the polarity of a pair is reversed."""

_PHASE_ERRORS = np.geomspace(LEAST_ERROR, 100 * np.pi, 40)
"""Scales of the error of a phase [rad], the last of which tells nothing of it."""

Likelihoods = Float[np.ndarray, "draw sensor actuator"]


def log_likelihoods(
    frf: Complex[np.ndarray, "sensor actuator frequency"],
    frequency: Float[np.ndarray, "frequency"],
    model: Model,
    mistake: Mistake,
    has_phase: bool,
) -> Likelihoods:
    """Logarithm of the probability of each record, if a mistake was made of each model response.

    Errors of log amplitude and of phase follow Laplace's distribution with scales of their own,
    which are integrated out, as is the gain of each record (by its median). Neighbouring lines
    have much in common, so that they count as few as the record itself turns.

    Parameters
    ----------
    frf
        Records, without zeros.
    frequency
        Lines [Hz].
    model
        Responses at draws from the priors, at the lines that the mistake leaves.
    mistake
        The mistake.
    has_phase
        Whether phases are known.
    """
    size = mistake.log_size(frf, model, frequency)
    apart = size - np.log(np.abs(model))
    apart = np.abs(apart - np.median(apart, axis=-1, keepdims=True)).mean(axis=-1)
    slope = mistake.log_slope(size)
    count = _independent(np.log(np.abs(frf)))
    of_size = count * (slope.mean(axis=-1) - np.log(np.maximum(apart, LEAST_ERROR)))
    of_size = np.where(np.isnan(of_size), -np.inf, of_size)
    if not has_phase:
        return of_size
    knows_phase = np.any(frf.imag, axis=-1)
    return of_size + np.where(knows_phase, _of_phase(frf, model, mistake), 0.0)


def _of_phase(frf: np.ndarray, model: Model, mistake: Mistake) -> Likelihoods:
    """Logarithm of the probability of the phases, whatever the polarity and the error are."""
    count = _independent(frf / np.abs(frf))[..., None]
    of_polarity = []
    for polarity, prior in ((1, 1 - REVERSED), (-1, REVERSED)):
        expected = np.exp(1j * mistake.phase(np.angle(polarity * model)))
        apart = np.abs(np.angle(frf * expected.conj())).mean(axis=-1)[..., None]
        density = -apart / _PHASE_ERRORS - np.log(
            -2 * _PHASE_ERRORS * np.expm1(-np.pi / _PHASE_ERRORS)
        )
        of_error = logsumexp(count * density, axis=-1) - np.log(_PHASE_ERRORS.size)
        of_polarity.append(of_error + np.log(prior))
    return np.asarray(np.logaddexp(*of_polarity))


def _independent(values: Shaped[np.ndarray, "*pair frequency"]) -> Float[np.ndarray, "*pair"]:
    """Number of random values whose path is as long, over the mean distance of two of them."""
    path = np.abs(np.diff(values)).sum(axis=-1)
    others = np.random.default_rng(0).permutation(values, axis=-1)
    return np.asarray(path / np.maximum(np.abs(values - others).mean(axis=-1), np.finfo(float).tiny))
