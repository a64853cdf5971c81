"""Overloaded channels: records that are clipped or flat."""

from collections.abc import Iterator

import numpy as np

from ..._shared.dimensions import Spectrum
from .._noise_level import FEWEST_LINES
from .record import Fault, Record

ROUNDING = 1e-6
"""Relative distance of numbers that are one: universal files carry six digits."""

FLAT_SHARE = 0.5
"""Share of lines with one value from which on a record is flat."""

CLIPPED_LINES = 5
"""Neighbouring lines at the greatest value from which on a record is clipped."""


def can_check(record: Record) -> bool:
    """Tell whether there are lines enough."""
    return record.frequency.size >= FEWEST_LINES


def check(record: Record) -> Iterator[Fault]:
    """Find records that stay at one value: at their greatest, or at most lines.

    A resonance touches its greatest value at one line; a range that is exceeded stays there.
    """
    for pair in record.pairs:
        frf = record.frf[pair]
        parts = {"amplitude": np.abs(frf), "real part": frf.real, "imaginary part": frf.imag}
        for part, values in parts.items():
            stays = _at_greatest(values)
            flat, run = float(stays.mean()), _longest_run(stays)
            if flat <= FLAT_SHARE and run < CLIPPED_LINES:
                continue
            if not np.abs(values).max() > 0 and part != "amplitude":
                continue  # a part that is zero throughout is no range that was exceeded
            first = record.frequency[int(np.argmax(stays))]
            what = (
                f"is flat: it has one value at {100 * flat:.0f} % of its lines"
                if flat > FLAT_SHARE
                else f"is clipped: it stays at its greatest value for {run} lines from "
                f"{first:.4g} Hz on"
            )
            yield record.fault(
                pair,
                max(flat, run / CLIPPED_LINES),
                FLAT_SHARE if flat > FLAT_SHARE else 1.0,
                f"The {part} of {record.label(pair)} {what}, as of a channel that was overloaded "
                "or not connected; measure it again with a wider range, or leave it out.",
            )
            break


def _at_greatest(values: Spectrum) -> np.ndarray:
    greatest = np.abs(values).max()
    return np.asarray(np.abs(values) >= greatest * (1 - ROUNDING))


def _longest_run(stays: np.ndarray) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], stays, [False]])))
    return int(np.max(edges[1::2] - edges[::2], initial=0))
