"""Numbers in the units in which people speak of them: mm, %, GPa, degrees."""

from typing import NamedTuple

import numpy as np

SCALES = {
    "m": (1e3, "mm"),
    "Pa": (1e-9, "GPa"),
    "rad": (57.29577951308232, "deg"),
    "s": (1e3, "ms"),
    "1/m": (1e-3, "1/mm"),
}
"""Factor and unit by the unit of a number."""

SHARES = ("ratio", "loss_factor")
"""Ends of names of numbers that are told in percent."""


INTERVAL = (2.5, 97.5)
"""Percentiles between which 95 % lie."""


class Scale(NamedTuple):
    """A unit, and the factor by which a number in SI is multiplied."""

    factor: float
    unit: str


def scale_of(name: str, unit: str) -> Scale:
    """Return the unit in which an unknown is told.

    Parameters
    ----------
    name
        Its name, `structure.damping.ratio[0]`.
    unit
        Its unit in SI.
    """
    field = name.partition("[")[0].split(".")
    if unit == "1" and any(word in SHARES for word in field):
        return Scale(100.0, "%")
    return Scale(*SCALES.get(unit, (1.0, unit)))


def rounded(value: float, spread: float) -> float:
    """Round a number to the second digit of its standard deviation; as it is where that is zero."""
    if not (np.isfinite(spread) and spread > 0):
        return value
    return round(value, 1 - int(np.floor(np.log10(spread))))


def summary(draws: np.ndarray) -> tuple[float, float, float, float]:
    """Mean, standard deviation and both ends of the 95 % interval, with digits that mean anything.

    Parameters
    ----------
    draws
        Draws [draw].
    """
    spread = float(draws.std())
    low, high = np.percentile(draws, INTERVAL)
    mean, low, high = (rounded(float(value), spread) for value in (draws.mean(), low, high))
    return mean, float(f"{spread:.2g}"), low, high
