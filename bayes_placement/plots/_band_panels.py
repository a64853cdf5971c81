"""Panels of measured outputs and the band in which a model expects them."""

import xarray as xr
from matplotlib.axes import Axes

from ._colours import AFTER, DATA
from ._figures import HALF_TURN, LOGARITHM, phase_axis, unbroken

POSTERIOR = AFTER
"""Colour of posteriors."""

SPARSE = 30
"""Up to so many lines are marked one by one, since the curve between them is no measurement."""


def draw_band(panel: Axes, channel: xr.Dataset, name: str) -> None:
    """Draw mean and band, what was measured, and the reference."""
    lines, low, high = (channel[variable].values for variable in ("frequency", "low", "high"))
    label = f"{name}, 90 % band"
    panel.fill_between(lines, low, high, color=POSTERIOR, alpha=0.3, label=label)
    style = "-" if lines.size > SPARSE else ".-"
    panel.plot(lines, channel["mean"], style, color=POSTERIOR, label=f"{name}, mean")
    if "measured" in channel:
        panel.plot(lines, channel["measured"], ".", color=DATA, label="measured")
    if "reference" in channel:
        panel.plot(lines, channel["reference"], color=DATA, label="as recorded", linewidth=1)


def draw_phases(panel: Axes, channel: xr.Dataset) -> None:
    """Draw mean and band of the phase, and what was measured."""
    lines, mean, low, high = (channel[key].values for key in ("frequency", "mean", "low", "high"))
    for shift in (-2 * HALF_TURN, 0.0, 2 * HALF_TURN):  # a band goes on at the other end
        panel.fill_between(
            lines, low + shift, high + shift, color=POSTERIOR, alpha=0.3, linewidth=0
        )
    panel.plot(lines, unbroken(mean), color=POSTERIOR)
    if "measured" in channel:
        panel.plot(lines, channel["measured"], ".", color=DATA)
    phase_axis(panel)


def unit_of_difference(unit: str) -> str:
    """A difference of logarithms is that of a ratio."""
    return "[dB]" if unit.startswith(LOGARITHM) else unit.rpartition(" ")[2]
