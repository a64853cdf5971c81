"""Samples of a channel that was overloaded, or was not connected."""

import numpy as np

from .records import Records, Samples

PLATEAU = 3
"""Equal samples in a row at a greatest value from which on a record is clipped."""

STEPS = 2.5
"""Least step onto a plateau, in the smallest step of the record: a coarse record of a smooth peak
has plateaus too, with steps of one digit next to them."""

PILE, PILED = 5, 4.0
"""Samples at the greatest value, and their ratio to those at the next one, from which on it is a
limit: at the peaks of a sine there are 2.4 times as many in the highest digit as in the next one,
and a record that repeats itself has each of its values as often as the greatest."""

ROUNDING = 1e-9
"""Distance of samples that are one value, as a share of the greatest: a period that was computed
without noise comes back rounded in another way."""

FULL = 0.995
"""Share of its range from which on a channel is overloaded."""


def fault(records: Records, record: int, part: slice = slice(None)) -> str | None:
    """Say which channel of a record is overloaded or dead, and when; None where none is."""
    start = part.start or 0
    for label, samples in records.channels(record).items():
        words = _fault(samples[part], records.ranges.get(label), records.rate, start)
        if words is not None:
            return f"{label} {words}"
    return None


def _fault(samples: Samples, limit: float | None, rate: float, start: int) -> str | None:
    size = np.abs(samples)
    greatest = float(size.max())
    if np.ptp(samples) == 0:
        return f"stays at {samples[0]:.4g} throughout, as a channel that is not connected"
    if limit is not None and greatest >= FULL * limit:
        when = (start + int(np.argmax(size >= FULL * limit))) / rate
        return f"reaches its range of {limit:.4g} at {when:.4g} s: it is overloaded"
    digit = float(np.min(np.diff(np.unique(samples))))
    plateaus = [_plateau(samples, sign * samples >= greatest, digit) for sign in (1, -1)]
    first = min((plateau for plateau in plateaus if plateau is not None), default=None)
    if first is not None:
        return f"is clipped: it stays at its greatest value from {(start + first) / rate:.4g} s on"
    touched = _piled(size, max(digit / 2, ROUNDING * greatest))
    if touched:
        return f"is clipped: it reaches its greatest value, {greatest:.4g}, {touched} times"
    return None


def _piled(size: Samples, resolution: float) -> int:
    """Number of samples at the greatest value where they are too many; 0 where they are not."""
    touched = size > size.max() - resolution
    if touched.sum() < PILE or touched.all():
        return 0
    below = size[~touched]
    following = np.sum(below > below.max() - resolution)
    return int(touched.sum()) if touched.sum() > PILED * following else 0


def _plateau(samples: Samples, greatest: np.ndarray, digit: float) -> int | None:
    """First sample of a plateau at the greatest value that is entered and left by a large step."""
    edges = np.diff(np.concatenate([[False], greatest, [False]]).astype(int))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        if end - start >= PLATEAU and _steep(samples, start, end, STEPS * digit):
            return start
    return None


def _steep(samples: Samples, start: int, end: int, least: float) -> bool:
    before = abs(samples[start] - samples[start - 1]) if start > 0 else np.inf
    after = abs(samples[end - 1] - samples[end]) if end < samples.size else np.inf
    return bool(before > least and after > least)
