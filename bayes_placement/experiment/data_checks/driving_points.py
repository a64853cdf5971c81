"""Sign and phase at driving points: a passive structure takes energy there and gives none back."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Complex, Float

from .._noise_level import FEWEST_LINES
from ..quantities import quantity_of
from .record import Fault, Pair, Record, prior_responses

PHASE_ERROR = np.sin(np.deg2rad(10.0))
"""Sine of the phase error that instruments may have."""

SHARE = 0.02
"""Share of lines that may be on the wrong side besides."""

DEVIATIONS = 4.0
"""Standard deviations of the noise within which a line is not on the wrong side."""

_PARTS = {
    "receptance": "its imaginary part must not be positive",
    "mobility": "its real part must not be negative",
    "accelerance": "its imaginary part must not be negative",
}


def can_check(record: Record) -> bool:
    """Tell whether a sensor and an actuator share a place and an axis."""
    return bool(set(record.driving_points) & set(record.pairs)) and bool(record.moving.any())


def check(record: Record) -> Iterator[Fault]:
    """Find driving points whose FRF gives energy back.

    The power that a force brings in is |F|^2 Re(mobility) / 2, which no passive structure makes
    negative. A line counts where the phase is more than 10 degrees and four deviations of the
    noise on the wrong side. Where sensor and actuator may sit apart, as many lines may do so as in
    the worst of some draws from the priors.
    """
    lines = record.moving
    for pair, sign in record.driving_points.items():
        if not record.measured[pair]:
            continue
        sine = _power_sine(record, sign * record.frf[pair][lines], lines)
        wrong = sine < -PHASE_ERROR - DEVIATIONS * _sine_deviation(record, pair, lines)
        threshold = max(SHARE, 3 / wrong.size) + _share_by_placement(record, pair, sign, lines)
        if wrong.mean() > threshold:
            yield record.fault(
                pair, float(wrong.mean()), threshold, _sentence(record, pair, sine, wrong, lines)
            )


def _power_sine(
    record: Record, frf: Complex[np.ndarray, "line"], lines: Bool[np.ndarray, "frequency"]
) -> Float[np.ndarray, "line"]:
    """Power factor: the real part of the mobility over its amplitude [1]."""
    derivative = quantity_of(record.measurement.quantity).derivative
    mobility = frf * (2j * np.pi * record.frequency[lines]) ** (1 - derivative)
    return np.asarray(mobility.real / np.maximum(np.abs(mobility), np.finfo(float).tiny))


def _sine_deviation(
    record: Record, pair: Pair, lines: Bool[np.ndarray, "frequency"]
) -> Float[np.ndarray, "line"]:
    size = np.maximum(np.abs(record.frf[pair][lines]), np.finfo(float).tiny)
    return np.asarray(np.sqrt(record.noise_variance[pair][lines] / 2) / size)


def _share_by_placement(
    record: Record, pair: Pair, sign: int, lines: Bool[np.ndarray, "frequency"]
) -> float:
    """Largest share of wrong lines that the tolerances of the placement explain."""
    if record.exact(pair):
        return 0.0
    _, draws = prior_responses(record, record.frequency[lines])
    shares = [
        np.mean(_power_sine(record, sign * response[pair], lines) < -PHASE_ERROR)
        for response in draws
    ]
    return float(max(shares))


def _sentence(
    record: Record,
    pair: Pair,
    sine: Float[np.ndarray, "line"],
    wrong: Bool[np.ndarray, "line"],
    lines: Bool[np.ndarray, "frequency"],
) -> str:
    worst = record.frequency[lines][int(np.argmin(np.where(wrong, sine, 1.0)))]
    rule = _PARTS[record.measurement.quantity]
    if record.driving_points[pair] < 0:
        rule = rule.replace("its", "with the opposite directions of the two, minus its")
    reversed_throughout = wrong.size >= FEWEST_LINES and np.mean(sine < 0) > 0.9
    cause = (
        "one of the two has its polarity reversed: turn its direction round (or, if all driving "
        "points have it, accelerance was given as receptance, or the other way round)"
        if reversed_throughout
        else "the two are not at one place, or one of them lags: correct its position, or add "
        "effects.time_delay"
    )
    return (
        f"The driving point {record.label(pair)} has the wrong sign at {100 * wrong.mean():.0f} % "
        f"of its lines, most at {worst:.4g} Hz; {rule}, since the structure would otherwise give "
        f"energy back, so {cause}."
    )
