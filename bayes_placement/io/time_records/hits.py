"""Hits of a hammer in records: where they begin, and whether there is more than one."""

from typing import NamedTuple

import numpy as np
from scipy.signal import find_peaks

from .records import Records, Samples

AUTOMATIC = 0.1
"""Share of the greatest force of a record at which a hit begins, where no force is stated."""

DEVIATIONS = 6.0
"""Deviations of the noise before a hit that a second peak of the force exceeds."""


class Hit(NamedTuple):
    """A hit in a record: the sample at which it begins, and those that belong to it."""

    record: int
    onset: int
    part: slice

    def quiet(self, before: int | None) -> int:
        """Samples at its beginning that hold noise only: half of those before the force."""
        lead = self.onset - self.part.start
        return (lead if before is None else min(lead, before)) // 2


def hit_per_record(records: Records) -> list[Hit]:
    """Return a hit for each record, with all samples of it."""
    return [
        Hit(number, onset(force), slice(0, force.size))
        for number, force in enumerate(records.force)
    ]


def onset(force: Samples) -> int:
    """Sample at which the force passes a tenth of its greatest value."""
    size = np.abs(force - np.median(force))
    return int(np.argmax(size >= AUTOMATIC * size.max()))


def over_trigger(records: Records, trigger: float | None, before: int, length: int) -> list[Hit]:
    """Hits in records, each where the force passes a trigger [N]: None is a tenth of the greatest.

    A hit has so many samples before the trigger, and in all.
    """
    return [
        Hit(number, begin, slice(begin - before, begin - before + length))
        for number, force in enumerate(records.force)
        for begin in _onsets(force, trigger, length - before)
    ]


def _onsets(force: Samples, trigger: float | None, blind: int) -> list[int]:
    """Samples at which the force passes the trigger, not within a hit that began before."""
    size = np.abs(force - np.median(force))
    level = AUTOMATIC * float(size.max()) if trigger is None else trigger
    above = np.flatnonzero((size[1:] >= level) & (size[:-1] < level)) + 1
    chosen: list[int] = []
    for begin in above.tolist():
        if not chosen or begin >= chosen[-1] + blind:
            chosen.append(begin)
    return chosen


def second_hit(force: Samples, quiet: int, share: float) -> int | None:
    """Sample of a second peak in the force [N] of a hit; None where there is one peak only.

    The force has no offset and begins with quiet samples; a second peak exceeds a share of the
    greatest, and stands out by it.
    """
    peak = int(np.argmax(np.abs(force)))
    noise = float(np.std(force[:quiet])) if quiet > 1 else 0.0
    least = max(share * abs(float(force[peak])), DEVIATIONS * noise)
    peaks, _ = find_peaks(np.sign(force[peak]) * force, height=least, prominence=least)
    further_peaks = [place for place in peaks.tolist() if place != peak]
    return further_peaks[0] if further_peaks else None
