"""Impedance paper: straight lines of constant mass, spring and dashpot behind a law."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.ticker import EngFormatter

from ._colours import FAINT, FLOOR, Style

Ends = Float[np.ndarray, "2"]

MOST = 4
"""Most lines of one kind of element."""

INSIDE = 0.04
"""Share of a panel that labels stay away from its corners."""


class Ruling(NamedTuple):
    """Lines of one kind of element."""

    power: int
    """Power of omega in its dynamic stiffness."""
    unit: str
    """Its unit for `EngFormatter`."""
    scale: float = 1.0
    """What of this unit one of SI is: a kilogram is 1000 g."""


OF_UNIT = {
    "N/m": (Ruling(0, "N/m"), Ruling(1, "N s/m"), Ruling(2, "g", 1e3)),
    "N m/rad": (Ruling(0, "N m/rad"), Ruling(1, "N m s/rad"), Ruling(2, "g m²", 1e3)),
    "m/N": (Ruling(0, "N/m"), Ruling(1, "N s/m")),
    "rad/(N m)": (Ruling(0, "N m/rad"), Ruling(1, "N m s/rad")),
}
"""Rulings by the unit of a law; none of masses in a cut, where there are none."""


def rule(panel: Axes, unit: str, with_masses: bool) -> None:
    """Draw the lines over a panel in logarithms, whose limits stay, with their values at its edges.

    Springs are labelled at the right, dashpots above, masses below. The panel shows a magnitude
    over frequency [Hz]; of a compliance lines fall.
    """
    sign = -1 if unit.startswith(("m/", "rad")) else 1
    limits = np.array([*panel.get_xlim()]), np.array([*panel.get_ylim()])
    for ruling in OF_UNIT[unit][: 3 if with_masses else 2]:
        for value, place in _lines(ruling, sign, *limits):
            size = (value * (2 * np.pi * limits[0]) ** ruling.power) ** sign
            panel.plot(limits[0], size, color=FAINT, linewidth=0.7, zorder=0.5)
            _label(panel, ruling, value, place)
    panel.set(xlim=limits[0], ylim=limits[1])


def _lines(ruling: Ruling, sign: int, x: Ends, y: Ends) -> Iterator[tuple[float, float]]:
    """Values of lines that cross the edge at which they are labelled, and where along it."""
    ends = np.quantile(np.log(2 * np.pi * x), [INSIDE, 1 - INSIDE])
    edge = np.log(y[0] if ruling.power == 2 else y[1])
    logs = sign * edge - ruling.power * ends
    if ruling.power == 0:
        logs = sign * np.quantile(np.log(y), [INSIDE, 1 - INSIDE])
    for value in _round(*np.sort(np.exp(logs))):
        place = (sign * edge - np.log(value)) / max(ruling.power, 1)
        yield value, value**sign if ruling.power == 0 else np.exp(place) / (2 * np.pi)


def _round(low: float, high: float) -> Float[np.ndarray, "line"]:
    """At most a few round numbers in a range: powers of ten, or 1, 2 and 5 times these."""
    tens = 10.0 ** np.arange(np.floor(np.log10(low)), np.log10(high))
    for steps in (np.ones(1), np.array([1.0, 2.0, 5.0])):
        values = np.outer(tens, steps).ravel()
        values = values[(values > low) & (values < high)]
        if values.size > 1:
            break
    return values[:: -(-values.size // MOST) or 1]


def _label(panel: Axes, ruling: Ruling, value: float, place: float) -> None:
    """Value of a line where it leaves the panel."""
    words = EngFormatter(ruling.unit, sep=" ")(ruling.scale * value)
    style: Style = {"color": FLOOR, "fontsize": "small", "textcoords": "offset points"}
    if ruling.power == 0:
        across = panel.get_yaxis_transform()
        panel.annotate(words, (1.0, place), xytext=(3, 0), xycoords=across, va="center", **style)
        return
    along, above = panel.get_xaxis_transform(), ruling.power == 1
    offset, side = ((0, 2), "bottom") if above else ((0, -5), "top")  # below the ticks
    at = (place, 1.0 if above else 0.0)
    panel.annotate(words, at, xytext=offset, xycoords=along, ha="center", va=side, **style)
