"""misfit: in, the misfit of a fitted model; out, one figure each: where the model fails.

Not known here: how anything was computed.
"""

from collections.abc import Iterator

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ..criticism.check.misfit import Misfit
from ._figures import (
    channel_panels,
    channels,
    edges,
    frequency_axis,
    legend,
    on_two_lines,
    panels,
    runs,
)

_MODEL, _DATA, _SECOND = "C0", "C3", "C1"
_FAINTEST, _BRIGHTEST = 0.3, 10.0
"""Least range of colours of the residual map [deviations]."""


def measured_against_band(misfit: Misfit) -> Figure:
    """Measured outputs and the 90 % band of what the model expects, for each channel pair."""
    response = misfit.response
    figure, axes = channel_panels(response, [1.0])
    for axis, at in channels(axes, response):
        lines, low, high = (at[name].values for name in ("frequency", "low", "high"))
        band = "posterior predictive, 90 % band"
        axis.fill_between(lines, low, high, color=_MODEL, alpha=0.3, label=band)
        axis.plot(lines, at["mean"], color=_MODEL, label="posterior mean")
        (points,) = axis.plot(lines, at["measured"], ".", color=_DATA)
        points.set(label="measured", markersize=4, zorder=1)
        axis.set_ylabel(on_two_lines(response["measured"].attrs["units"]))
    return legend(figure, axes)


def residual_map(misfit: Misfit) -> Figure:
    """Size of the residual over the noise, channel pair against frequency, for each force level."""
    levels = runs(misfit.response)
    figure, axes = panels(len(levels), 1)
    norm = LogNorm(_FAINTEST, max(_BRIGHTEST, float(misfit.response["misfit"].max())), clip=True)
    for axis, (run, at) in zip(axes.flat, levels, strict=True):
        pairs = at["misfit"].stack(pair=("sensor", "actuator")).transpose("pair", "frequency")
        names = [f"{sensor}, {actuator}" for sensor, actuator in pairs["pair"].values]
        lines = at["frequency"].values
        mesh = axis.pcolormesh(edges(lines), np.arange(len(names) + 1) - 0.5, pairs, norm=norm)
        axis.set_yticks(range(len(names)), names)
        frequency_axis(axis, lines)
        axis.set_ylabel("channel [sensor, actuator]")
        axis.set_title(f"residual{run}")
    unit = misfit.response["misfit"].attrs["units"]
    figure.colorbar(mesh, ax=axes.ravel().tolist(), label=f"size of residual [{unit}]")
    return figure


def discrepancy(misfit: Misfit) -> Figure:
    """Residuals and their smooth part with its 95 % band over the noise, for each channel pair."""
    over = misfit.response["residual_over_noise"]
    noise = misfit.response["residual"] / over
    smooth = misfit.discrepancy[["mean", "low", "high"]] / noise
    both = smooth.assign(residual=over)
    figure, axes = channel_panels(both, [1.0])
    for axis, channel in channels(axes, both):
        axis.axhline(0.0, color="k", linewidth=0.5)
        for (part, one), color in zip(_parts(channel), (_MODEL, _SECOND), strict=False):
            _discrepancy(axis, one, part, color)
        axis.set_ylabel(f"discrepancy\n[{over.attrs['units']}]")
    return legend(figure, axes)


def _discrepancy(axis: Axes, one: xr.Dataset, label: str, color: str) -> None:
    lines, low, high = (one[name].values for name in ("frequency", "low", "high"))
    (points,) = axis.plot(lines, one["residual"], ".", color=color)
    points.set(label=f"residual{label}", markersize=4, alpha=0.5)
    axis.plot(lines, one["mean"], color=color, label=f"discrepancy{label}")
    band = f"discrepancy{label}, 95 % band"
    axis.fill_between(lines, low, high, color=color, alpha=0.3, label=band)


def _parts(dataset: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    if "part" not in dataset.dims:
        yield "", dataset
        return
    for part in dataset["part"].values:
        yield f", {part} part", dataset.sel(part=part)
