"""All FRFs larger or smaller than the model by one factor that a mistaken unit makes."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp

from .mistaken_records import LEAST_ODDS, MISTAKEN
from .mistakes import LEAST_ERROR
from .record import Fault, Record, prior_responses
from .rigid_body_line import KNOWN_FACTORS

FACTORS = np.array([factor for factor in KNOWN_FACTORS if abs(np.log(factor)) > np.log(4.0)])
"""Those of units: by a smaller factor modal masses, gains and missing effects change FRFs too."""

ERRORS = np.geomspace(LEAST_ERROR, 3.0, 40)
"""Scales of the error of the log gains of a model, which are unknown."""


def can_check(record: Record) -> bool:
    """Tell whether the structure is held: a free one is compared with its rigid-body line."""
    return record.experiment.structure.modes.rigid_body_modes == 0


def check(record: Record) -> Iterator[Fault]:
    """Find the factor at which gains of all pairs are far more probable than at 1.

    The gain of a pair is the median over the lines of the FRF over that of the model at a draw from
    the priors. Its logarithm errs by Laplace's distribution of an unknown scale.
    """
    gains = _log_gains(record)
    evidence = np.array([_log_evidence(gains - np.log(factor)) for factor in FACTORS])
    log_odds = evidence - _log_evidence(gains) + np.log(MISTAKEN / FACTORS.size)
    best = int(np.argmax(log_odds))
    factor = FACTORS[best]
    if log_odds[best] > np.log(LEAST_ODDS):
        log10_odds = float(log_odds[best] / np.log(10))
        odds = f"{10**log10_odds:.0f}" if log10_odds < 3 else f"1e{int(log10_odds)}"
        yield record.fault(
            next(record.pairs),
            log10_odds,
            float(np.log10(LEAST_ODDS)),
            f"All FRFs are those of the model times {factor:.3g} "
            f"({KNOWN_FACTORS[factor]}), at odds of {odds} to 1; (m/s²)/N, (m/s)/N or "
            "m/N are needed: divide them by this factor.",
        )


def _log_gains(record: Record) -> Float[np.ndarray, "draw pair"]:
    """Logarithm of the gain of each pair at the nominal values and at draws from the priors."""
    moving = record.frequency > 0
    nominal, draws = prior_responses(record, record.frequency[moving])
    size = np.abs(np.stack([nominal, *draws])[:, record.measured])
    measured = np.abs(record.frf[record.measured][:, moving])
    with np.errstate(divide="ignore", invalid="ignore"):  # of zeros
        return np.asarray(np.median(np.log(measured) - np.log(size), axis=-1))


def _log_evidence(errors: Float[np.ndarray, "draw pair"]) -> float:
    """Logarithm of the probability of all errors of a draw, over draws and scales."""
    size = np.abs(errors).sum(axis=1)[:, None]
    of_scales = -errors.shape[1] * np.log(2 * ERRORS) - size / ERRORS
    return float(logsumexp(of_scales) - np.log(of_scales.size))
