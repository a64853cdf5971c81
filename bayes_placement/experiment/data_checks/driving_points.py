"""What passive, linear structures obey: driving points give no energy back, H_ij is H_ji."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Complex, Float

from ..._shared.dimensions import ComplexSpectrum
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


def has_driving_points(record: Record) -> bool:
    """Tell whether a sensor and an actuator share a place and an axis."""
    return bool(set(record.driving_points) & set(record.pairs)) and bool(record.moving.any())


def energy_given_back(record: Record) -> Iterator[Fault]:
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
        sine = _power_sine(record, sign * record.frf[pair][lines])
        wrong = sine < -PHASE_ERROR - DEVIATIONS * _sine_deviation(record, pair)
        threshold = max(SHARE, 3 / wrong.size) + _share_by_placement(record, pair, sign)
        if wrong.mean() > threshold:
            sentence = _sentence(record, pair, sine, wrong)
            yield record.fault(pair, float(wrong.mean()), threshold, sentence)


def _power_sine(record: Record, frf: Complex[np.ndarray, "line"]) -> Float[np.ndarray, "line"]:
    """Power factor: the real part of the mobility over its amplitude [1]."""
    derivative = quantity_of(record.measurement.quantity).derivative
    mobility = frf * (2j * np.pi * record.frequency[record.moving]) ** (1 - derivative)
    return np.asarray(mobility.real / np.maximum(np.abs(mobility), np.finfo(float).tiny))


def _sine_deviation(record: Record, pair: Pair) -> Float[np.ndarray, "line"]:
    lines = record.moving
    size = np.maximum(np.abs(record.frf[pair][lines]), np.finfo(float).tiny)
    return np.asarray(np.sqrt(record.noise_variance[pair][lines] / 2) / size)


def _share_by_placement(record: Record, pair: Pair, sign: int) -> float:
    """Largest share of wrong lines that the tolerances of the placement explain."""
    if record.exact(pair):
        return 0.0
    _, draws = prior_responses(record, record.frequency[record.moving])
    sines = (_power_sine(record, sign * response[pair]) for response in draws)
    return float(max(np.mean(sine < -PHASE_ERROR) for sine in sines))


def _sentence(
    record: Record,
    pair: Pair,
    sine: Float[np.ndarray, "line"],
    wrong: Bool[np.ndarray, "line"],
) -> str:
    worst = record.frequency[record.moving][int(np.argmin(np.where(wrong, sine, 1.0)))]
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


DIFFERENCE = 0.1
"""Difference that gains of instruments explain [1], of the size of the two FRFs."""

Reciprocal = tuple[Pair, Pair, int]
"""Two pairs that exchange sensor and actuator, and the sign between them."""


def has_reciprocal_pairs(record: Record) -> bool:
    """Tell whether two pairs exchange sensor and actuator."""
    return record.frequency.size >= FEWEST_LINES and bool(_reciprocal(record))


def not_reciprocal(record: Record) -> Iterator[Fault]:
    """Find pairs that break Maxwell's reciprocity.

    The statistic is the root mean square of H_ij - H_ji over that of the two. It may be 10 %,
    and the noise of both, and twice the largest difference of some draws from the priors where
    sensor and actuator may sit apart.
    """
    for first, second, sign in _reciprocal(record):
        forward, backward = record.frf[first], sign * record.frf[second]
        square = DIFFERENCE**2 + _by_noise(record, first, second)
        square += _by_placement(record, first, second, sign)
        difference, threshold = _difference(forward, backward), float(np.sqrt(square))
        if difference > threshold:
            yield record.fault(
                first,
                difference,
                threshold,
                f"{record.label(first)} and {record.label(second)} differ by "
                f"{100 * difference:.0f} %, and at most {100 * threshold:.0f} % are expected, "
                f"since a linear structure is reciprocal ({_cause(forward, backward)}): look at "
                "gain, direction and place of these channels.",
            )


def _reciprocal(record: Record) -> list[Reciprocal]:
    driving, measured = record.driving_points, set(record.pairs)
    pairs = []
    for (row, column), sign in driving.items():
        for (other_row, other_column), other_sign in driving.items():
            first, second = Pair(row, other_column), Pair(other_row, column)
            if row < other_row and column != other_column and {first, second} <= measured:
                pairs.append((first, second, sign * other_sign))
    return pairs


def _difference(forward: ComplexSpectrum, backward: ComplexSpectrum) -> float:
    size = np.mean(np.abs(forward) ** 2 + np.abs(backward) ** 2) / 2
    return float(np.sqrt(np.mean(np.abs(forward - backward) ** 2) / size))


def _by_noise(record: Record, first: Pair, second: Pair) -> float:
    """Square of the difference that noise explains, with its scatter over the lines."""
    variance = record.noise_variance[first] + record.noise_variance[second]
    size = np.abs(record.frf[first]) ** 2 + np.abs(record.frf[second]) ** 2
    deviation = np.sqrt(np.sum(variance**2))
    return float(2 * (np.sum(variance) + DEVIATIONS * deviation) / np.sum(size))


def _by_placement(record: Record, first: Pair, second: Pair, sign: int) -> float:
    if record.exact(first) and record.exact(second):
        return 0.0
    lines = record.frequency > 0
    _, draws = prior_responses(record, record.frequency[lines])
    return 4 * max(_difference(draw[first], sign * draw[second]) ** 2 for draw in draws)


def _cause(forward: ComplexSpectrum, backward: ComplexSpectrum) -> str:
    """How the first differs from the second: by a factor, or otherwise."""
    factor = np.vdot(backward, forward) / np.vdot(backward, backward)
    if _difference(forward, factor * backward) < DIFFERENCE:
        sign = "minus " if factor.real < 0 else ""
        return f"the first is {sign}{abs(factor):.3g} times the second"
    return "by no common factor"
