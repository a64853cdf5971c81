"""Reciprocity: H_ij is H_ji where a sensor and an actuator share places both ways."""

from collections.abc import Iterator

import numpy as np

from ..._shared.dimensions import ComplexSpectrum
from .._noise_level import FEWEST_LINES
from .record import Fault, Pair, Record, prior_responses

DIFFERENCE = 0.1
"""Difference that gains of instruments explain [1], of the size of the two FRFs."""

DEVIATIONS = 4.0

Reciprocal = tuple[Pair, Pair, int]
"""Two pairs that exchange sensor and actuator, and the sign between them."""


def can_check(record: Record) -> bool:
    """Tell whether two pairs exchange sensor and actuator."""
    return record.frequency.size >= FEWEST_LINES and bool(_reciprocal(record))


def check(record: Record) -> Iterator[Fault]:
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
