"""Panels of measured outputs, of what models predict and of the errors between them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from .._shared.labels import AS_DRAWN
from ._colours import AFTER, BEFORE, DATA, FLOOR, INK
from ._figures import HALF_TURN, LOGARITHM, channels, in_decibels, phase_axis, unbroken

DASHES = (0, (4, 2))
"""Style of the line of a model as drawn."""

OUTSIDE = f"{AS_DRAWN}, beyond the edge"
"""Label of the marks where that model lies outside of a panel."""

MARGIN = 0.06
"""Share of what is shown that stays free above and below."""


def colours_of(models: Mapping[str, xr.Dataset]) -> dict[str, str]:
    """Colours of models by name; that as drawn has one of its own."""
    fitted = [name for name in models if name != AS_DRAWN]
    colours = [BEFORE, AFTER] if len(fitted) > 1 else [AFTER]
    known = {AS_DRAWN: FLOOR, **dict(zip(fitted, colours, strict=True))}
    return {name: known[name] for name in models}


def draw_measured(axes: np.ndarray, fit: xr.Dataset, rows: int) -> None:
    """Draw what was measured, once, as pale dots below the lines, which they would hide."""
    style: dict[str, Any] = {"color": DATA, "markersize": 5, "alpha": 0.5, "zorder": 1}
    style |= {"markeredgewidth": 0}
    for panel, channel in channels(axes[::rows], fit):
        measured, _ = in_decibels(channel["measured"], channel["measured"].attrs["units"])
        panel.plot(channel["frequency"], measured, ".", label="measured", **style)
    if "measured_phase" not in fit:
        return
    for panel, channel in channels(axes[1::rows], fit):
        panel.plot(channel["frequency"], channel["measured_phase"], ".", **style)


def draw_response(panel: Axes, channel: xr.Dataset, name: str, color: str) -> None:
    """Draw the amplitude that a model predicts; one as drawn may lie far below what is shown."""
    values, label = in_decibels(channel["predicted"], channel["predicted"].attrs["units"])
    panel.plot(channel["frequency"], values, label=name, **line_style(color))
    panel.set_ylabel(label)
    if color != FLOOR:
        measured, _ = in_decibels(channel["measured"], channel["measured"].attrs["units"])
        fitted = [curve.get_ydata() for curve in panel.lines if curve.get_color() != FLOOR]
        show_all_of(panel, [*map(np.asarray, fitted), measured.values])


def mark_outside(panel: Axes, channel: xr.Dataset) -> None:
    """Mark at the edges of a panel where the model as drawn lies outside of it."""
    values, _ = in_decibels(channel["predicted"], channel["predicted"].attrs["units"])
    low, high = panel.get_ylim()
    for is_outside, edge, marker in ((values < low, 0.0, "v"), (values > high, 1.0, "^")):
        lines = channel["frequency"].values[is_outside.values]
        if lines.size:
            style: dict[str, Any] = {"color": FLOOR, "markersize": 3, "linestyle": "none"}
            style |= {"marker": marker, "transform": panel.get_xaxis_transform()}
            panel.plot(lines, np.full(lines.size, edge), label=OUTSIDE, clip_on=False, **style)


def show_all_of(panel: Axes, curves: Sequence[np.ndarray]) -> None:
    """Let the axis reach over all of these curves, whatever else is drawn."""
    shown = np.concatenate([curve[np.isfinite(curve)] for curve in curves])
    margin = MARGIN * float(np.ptp(shown)) or 1.0
    panel.set_ylim(float(shown.min()) - margin, float(shown.max()) + margin)


def line_style(color: str) -> dict[str, Any]:
    """Style of the line of a model; that of one as drawn, before any fit, is grey and dashed."""
    return {"color": color, "linestyle": DASHES if color == FLOOR else "-", "linewidth": 1.1}


def draw_phase(panel: Axes, channel: xr.Dataset, color: str) -> None:
    """Draw the phase that a model predicts."""
    phase = unbroken(channel["predicted_phase"].values)
    panel.plot(channel["frequency"], phase, **line_style(color))
    phase_axis(panel)


def draw_error(panel: Axes, channel: xr.Dataset, name: str, color: str) -> None:
    """Draw what a model leaves, and the noise."""
    style = line_style(color) | {"linewidth": 0.8, "label": f"error, {name}"}
    panel.plot(channel["frequency"], channel["error"], **style)
    panel.plot(channel["frequency"], channel["noise"], color=INK, linewidth=1, label="noise")
    panel.set_yscale("log")
    label = channel["error"].attrs["units"]
    unit = "log10 of ratio]" if label.startswith("log10") else label.rpartition("[")[2]
    panel.set_ylabel(f"size of error\n[{unit}")


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
