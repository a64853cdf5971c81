"""What a posterior says of every unknown: mean, spread and interval, or the places of its peaks."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from jaxtyping import Float

from .estimates import scalars
from .units import ReadableUnit, readable

INTERVAL = (0.025, 0.975)
"""Quantiles between which 95 % of a posterior lie."""

LEAST_SHARE = 0.05
"""Share of the draws that a peak must have, at least."""

VALLEY = 0.5
"""Density between two peaks over that of the lower one, below which they are two."""

MOST_PEAKS = 4


class Peak(NamedTuple):
    """A peak of a posterior: its mean, and the share of the draws that belong to it."""

    mean: float
    share: float


class UnknownSummary(NamedTuple):
    """What a posterior says of one number, in SI."""

    name: str
    """Its name."""
    mean: float
    sd: float
    low: float
    high: float
    """Mean, standard deviation, and ends of the interval that holds 95 %."""
    unit: str
    """SI unit."""
    readable: ReadableUnit
    """Unit for people."""
    peaks: tuple[Peak, ...]
    """Its peaks where there is more than one; else empty."""

    def in_words(self) -> str:
        """Say where the peaks are: `two places: 263 or 283 mm (54 and 46 %)`."""
        counts = {2: "two", 3: "three", 4: "four"}
        what = "places" if self.unit == "m" else "values"
        values = " or ".join(self._numbers())
        shares = " and ".join(f"{100 * peak.share:.0f}" for peak in self.peaks)
        unit = f" {self.readable.name}" if self.readable.name else ""
        return f"{self.name}: {counts[len(self.peaks)]} {what}, {values}{unit} ({shares} %)"

    def cells(self) -> dict[str, str]:
        """Cells of a table for people."""
        deviation = self.sd
        ends = (self.readable.number(end, deviation) for end in (self.low, self.high))
        mean = self.readable.number(self.mean, deviation)
        return {
            "mean": " or ".join(self._numbers()) if self.peaks else mean,
            "sd": self.readable.spread(deviation, self.mean),
            "95 % interval": " to ".join(ends),
            "unit": self.readable.name,
        }

    def _numbers(self) -> list[str]:
        """Means of the peaks, to a tenth of their distance."""
        means = np.sort([peak.mean for peak in self.peaks])
        distance = float(np.diff(means).min()) / 2 if means.size > 1 else self.sd
        return [self.readable.number(peak.mean, distance) for peak in self.peaks]


def summary(result: xr.DataTree) -> list[UnknownSummary]:
    """Return what a result says of every unknown number of its posterior, in their order."""
    posterior = result["posterior"].to_dataset()
    return [row for name in posterior for row in _of(str(name), posterior[name])]


def numbers(rows: list[UnknownSummary]) -> pd.DataFrame:
    """Table in SI, for files: one row for each number."""
    table = pd.DataFrame(
        [
            {
                "unknown": row.name,
                "mean": row.mean,
                "sd": row.sd,
                "low_95": row.low,
                "high_95": row.high,
                "unit": row.unit,
                "peaks": " ".join(f"{peak.mean:.9g}" for peak in row.peaks),
            }
            for row in rows
        ]
    )
    return table.set_index("unknown")


def words(rows: list[UnknownSummary]) -> pd.DataFrame:
    """Table for people, in their units: one row for each number."""
    table = pd.DataFrame([{"unknown": row.name, **row.cells()} for row in rows])
    return table.set_index("unknown")


def _of(name: str, draws: xr.DataArray) -> Iterator[UnknownSummary]:
    unit, field = str(draws.attrs.get("units", "")), str(draws.attrs.get("field", ""))
    if draws.attrs.get("role") == "model error" and field == "standard":
        return  # hundreds of numbers in units of their size
    for label, values in scalars(name, draws.values):
        flat = np.asarray(values, dtype=float).ravel()
        low, high = np.quantile(flat, INTERVAL)
        scale = readable(unit, field, float(np.abs(flat).max()))
        yield UnknownSummary(
            label,
            float(flat.mean()),
            float(flat.std()),
            float(low),
            float(high),
            unit,
            scale,
            peaks(flat),
        )


def peaks(draws: Float[np.ndarray, "draw"]) -> tuple[Peak, ...]:
    """Return the peaks of a posterior, where it has more than one; each from left to right.

    Draws are split in two where that leaves the least variance, again and again. Two parts are two
    peaks where the density between them falls below half of that of the lower one.
    """
    parts = _split(np.sort(draws), len(draws))
    all_peaks = tuple(Peak(float(part.mean()), part.size / draws.size) for part in parts)
    return all_peaks if 1 < len(all_peaks) <= MOST_PEAKS else ()


def _split(ordered: np.ndarray, total: int) -> list[np.ndarray]:
    """Parts of ordered draws that are peaks of their own."""
    if ordered.size < 2 * LEAST_SHARE * total or ordered[0] == ordered[-1]:
        return [ordered]
    place = _least_variance(ordered)
    left, right = ordered[:place], ordered[place:]
    if min(left.size, right.size) < LEAST_SHARE * total or not _are_two(left, right):
        return [ordered]
    return [*_split(left, total), *_split(right, total)]


def _least_variance(ordered: np.ndarray) -> int:
    """Where to cut ordered draws in two, so that the variance within both parts is least."""
    count = np.arange(1, ordered.size)
    centred = ordered - ordered.mean()
    below = np.cumsum(centred)[:-1]
    # The variance between both parts is greatest where that within them is least.
    return int(np.argmax(below**2 / (count * (ordered.size - count)))) + 1


def _are_two(left: np.ndarray, right: np.ndarray) -> bool:
    """Whether the density between two parts falls far below that of the lower peak."""
    narrow, few = min(map(_spread, (left, right))), min(left.size, right.size)
    width = max(1.06 * narrow * few**-0.2, 1e-9 * float(right[-1] - left[0]))
    draws = np.concatenate([left, right])
    tops = [_top(draws, part, width) for part in (left, right)]
    between = _density(draws, np.linspace(tops[0][0], tops[1][0], 101), width)
    return bool(between.min() < VALLEY * min(density for _, density in tops))


def _spread(part: np.ndarray) -> float:
    low, high = np.quantile(part, [0.25, 0.75])
    return min(float(part.std()), float(high - low) / 1.349)


def _top(draws: np.ndarray, part: np.ndarray, width: float) -> tuple[float, float]:
    """Place and density of the peak of a part."""
    low, high = np.quantile(part, [0.01, 0.99])
    points = np.linspace(low, high, 101)
    density = _density(draws, points, width)
    place = int(np.argmax(density))
    return float(points[place]), float(density[place])


def _density(draws: np.ndarray, points: np.ndarray, width: float) -> np.ndarray:
    """Kernel density of draws at points, up to a factor."""
    return np.exp(-0.5 * ((points[:, None] - draws) / width) ** 2).sum(axis=1)
