"""Hum of the mains: lines at multiples of 50 or 60 Hz that stand out from those about them."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ..._shared.dimensions import ComplexSpectrum
from ...effects.mains_hum import FARTHEST, MAINS, close_to_multiples
from .record import Fault, Record

FEWEST_LINES = 40
"""Fewest lines among which one stands out."""

FALSE_ALARMS = 0.01
"""Probability that any line of a record of noise stands out."""

COINCIDENCE = 2e-3
"""Greatest probability that as many lines that stand out are at multiples by chance."""

SHARPEST = 4.0
"""How far a line must be off its neighbours, over what these are off theirs without it.

Below 3.7 for a resonance whose half-power width is more than half the spacing of the lines.
"""

NEARBY, LEFT_OUT = 16, 3
"""Lines on either side by which the scatter is judged, without the closest ones."""

_OFF = np.array([1, -4, 6, -4, 1]) / 6
"""A line less the cubic through two on either side."""

_FREEDOM = 8.0
"""Of the tail of a squared deviation over its median nearby, for which noise has more."""

Lines = Float[np.ndarray, "frequency"]


class _Hum(NamedTuple):
    """Lines of one pair that stand out at multiples of one frequency."""

    mains: float
    lines: Bool[np.ndarray, "frequency"]
    deviation: float
    coincidence: float
    actuator: int


def can_check(record: Record) -> bool:
    """Tell whether there are lines enough, closer than the multiples by far."""
    return record.frequency.size >= FEWEST_LINES and can_have_hum(record.frequency)


def can_have_hum(lines: Lines) -> bool:
    """Tell whether lines are closer to each other than the multiples by far."""
    return bool(lines.size > 1 and _width(lines) <= FARTHEST * MAINS[0])


def check(record: Record) -> Iterator[Fault]:
    """Find sensor channels with hum at two multiples or more of 50 or 60 Hz.

    A line stands out where it is off the cubic through its neighbours by more than noise makes
    one of all lines, by the median of those nearby, and where these fit one another without it,
    as they do not at a resonance. Where other lines stand out as well, it must be improbable that
    as many of them are at multiples by chance.
    """
    found: dict[int, list[_Hum]] = {}
    pairs = list(record.pairs)
    for pair in pairs:
        squared = _squared_deviation(record.frf[pair], record.frequency)
        limit = _greatest(record.frequency.size * len(pairs))
        for mains in MAINS:
            hum = at_multiples(squared, limit, record.frequency, mains)
            if hum is not None:
                found.setdefault(pair.sensor, []).append(hum._replace(actuator=pair.actuator))
    for sensor, hums in found.items():
        yield _fault(record, sensor, hums)


def _width(lines: Lines) -> float:
    return 0.5 * float(np.min(np.diff(lines)))


def _greatest(count: int) -> float:
    """Squared deviation, over its scale, that noise exceeds in one of so many lines by chance."""
    return float(_FREEDOM * ((FALSE_ALARMS / count) ** (-1 / _FREEDOM) - 1))


def _squared_deviation(frf: ComplexSpectrum, lines: Lines) -> Lines:
    """Squared deviation of each line from its neighbours, over that of the lines nearby.

    Zero for lines that are not sharp; NaN where the lines about it are not evenly spaced.
    """
    off = np.full(lines.size, np.nan)
    off[2:-2] = np.abs(np.convolve(frf, _OFF, "valid"))
    squared = np.full(lines.size, np.nan)
    inner = np.arange(3, lines.size - 3)
    even = np.ptp(np.lib.stride_tricks.sliding_window_view(np.diff(lines), 6), axis=1)
    is_even = even < 1e-3 * np.diff(lines)[inner]
    beside = np.maximum(_beside(frf), _beside(frf[::-1])[::-1])
    sharp = off[inner] > SHARPEST * beside
    squared[inner[is_even]] = 0.0
    for line in inner[is_even & sharp].tolist():
        squared[line] = off[line] ** 2 / _scale(off, line)
    return squared


def _beside(frf: ComplexSpectrum) -> Float[np.ndarray, "inner"]:
    """How far the line after each inner one is off the cubic through others, without that one."""
    size = frf.size - 6
    part = [frf[start : start + size] for start in range(7)]
    return np.asarray(np.abs(part[4] + 0.2 * part[1] - 0.5 * part[2] - part[5] + 0.3 * part[6]))


def _scale(off: Lines, line: int) -> float:
    """Mean squared deviation of the lines nearby by its median, that of noise."""
    before = off[max(line - NEARBY, 0) : line - LEFT_OUT + 1]
    nearby = np.concatenate([before, off[line + LEFT_OUT : line + NEARBY + 1]])
    return max(float(np.nanmedian(nearby**2)) / np.log(2), np.finfo(float).tiny)


def at_multiples(squared: Lines, limit: float, lines: Lines, mains: float) -> _Hum | None:
    """Lines that stand out at multiples; None of fewer than two, or where chance explains them.

    How far a line stands out is NaN where that cannot be judged. Frequencies are in Hz.
    """
    judged = np.isfinite(squared)
    close = np.asarray(close_to_multiples(lines, mains, _width(lines))) & judged
    out = judged & (np.nan_to_num(squared) > limit)
    both = close & out
    if np.unique(np.round(lines[both] / mains)).size < 2:
        return None
    from scipy.stats import hypergeom  # it takes long to import

    chance = hypergeom.sf(both.sum() - 1, judged.sum(), close.sum(), out.sum())
    if chance > COINCIDENCE:
        return None
    return _Hum(mains, both, float(np.sqrt(squared[both].max())), float(chance), 0)


def _fault(record: Record, sensor: int, hums: list[_Hum]) -> Fault:
    """One sentence for a sensor channel, with the lines of all its pairs."""
    mains = min(hums, key=lambda hum: hum.coincidence).mains
    hums = [hum for hum in hums if hum.mains == mains]
    worst = max(hums, key=lambda hum: hum.deviation)
    lines = record.frequency[np.any([hum.lines for hum in hums], axis=0)]
    channel = record.measurement.sensors[sensor].label
    return Fault(
        channel,
        record.measurement.actuators[worst.actuator].label,
        worst.deviation,
        float(np.sqrt(_greatest(record.frequency.size * len(list(record.pairs))))),
        f"{channel} at {', '.join(f'{line:.4g}' for line in lines)} Hz: hum of the mains, at "
        f"multiples of {mains:.0f} Hz. These lines stand out from their neighbours by up to "
        f"{worst.deviation:.0f} times the scatter nearby; leave them out, "
        f"measurement.without({lines[0]:.4g}, {lines[0]:.4g}), and look for a ground loop.",
    )
