"""Panels of measured outputs and those of fitted models, and of the errors between them."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from ._colours import DATA, INK
from ._figures import channels, in_decibels, phase_axis, unbroken


def draw_measured(axes: np.ndarray, fit: xr.Dataset, rows: int) -> None:
    """Draw what was measured, once, above the lines, which would hide it."""
    style: dict[str, Any] = {"color": DATA, "markersize": 4, "zorder": 3}
    for panel, channel in channels(axes[::rows], fit):
        measured, _ = in_decibels(channel["measured"], channel["measured"].attrs["units"])
        panel.plot(channel["frequency"], measured, ".", label="measured", **style)
    if "measured_phase" not in fit:
        return
    for panel, channel in channels(axes[1::rows], fit):
        panel.plot(channel["frequency"], channel["measured_phase"], ".", **style)


def draw_response(panel: Axes, channel: xr.Dataset, name: str, color: str) -> None:
    """Draw the amplitude that a model predicts."""
    values, label = in_decibels(channel["predicted"], channel["predicted"].attrs["units"])
    panel.plot(channel["frequency"], values, color=color, label=name)
    panel.set_ylabel(label)


def draw_phase(panel: Axes, channel: xr.Dataset, color: str) -> None:
    """Draw the phase that a model predicts."""
    phase = unbroken(channel["predicted_phase"].values)
    panel.plot(channel["frequency"], phase, color=color)
    phase_axis(panel)


def draw_error(panel: Axes, channel: xr.Dataset, name: str, color: str) -> None:
    """Draw what a model leaves, and the noise."""
    (points,) = panel.plot(channel["frequency"], channel["error"], ".", color=color)
    points.set(label=f"error, {name}", markersize=4)
    panel.plot(channel["frequency"], channel["noise"], color=INK, linewidth=1, label="noise")
    panel.set_yscale("log")
    label = channel["error"].attrs["units"]
    unit = "log10 of ratio]" if label.startswith("log10") else label.rpartition("[")[2]
    panel.set_ylabel(f"size of error\n[{unit}")
