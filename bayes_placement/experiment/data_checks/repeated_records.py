"""Repeated records: two channels that hold the same numbers."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Complex

from .._noise_level import FEWEST_LINES
from .record import Fault, Record

ROUNDING = 1e-6
"""Relative distance of two copies of one record: universal files carry six digits."""

PARALLEL = 1e-10
"""Loss of correlation below which two records are compared; of two copies it is 1e-12."""


def can_check(record: Record) -> bool:
    """Tell whether there are two pairs to compare."""
    return record.frequency.size >= FEWEST_LINES and int(record.measured.sum()) > 1


def check(record: Record) -> Iterator[Fault]:
    """Find two records that are one, up to its sign.

    Two measurements of one thing differ by their noise; only a copy agrees to six digits.
    """
    pairs = list(record.pairs)
    for first, second in _alike(np.stack([record.frf[pair] for pair in pairs])):
        distance = _distance(record.frf[pairs[first]], record.frf[pairs[second]])
        if distance < ROUNDING:
            yield record.fault(
                pairs[second],
                distance,
                ROUNDING,
                f"{record.label(pairs[first])} and {record.label(pairs[second])} hold the same "
                "record to six digits, and two measurements would differ by their noise: it was "
                "exported twice or cabled wrongly, so leave one of them out.",
            )


def _alike(records: Complex[np.ndarray, "record frequency"]) -> list[tuple[int, int]]:
    """Numbers of two records, the second with the first that it is parallel to."""
    size = np.linalg.norm(records, axis=1, keepdims=True)
    unit = records / np.where(size > 0, size, 1.0)
    parallel = np.triu(np.abs((unit @ unit.conj().T).real) > 1 - PARALLEL, 1)
    return [(int(np.argmax(column)), n) for n, column in enumerate(parallel.T) if column.any()]


def _distance(first: np.ndarray, second: np.ndarray) -> float:
    size = np.linalg.norm(first)
    apart = min(np.linalg.norm(first - second), np.linalg.norm(first + second))
    return float(apart / size) if size > 0 else 0.0
