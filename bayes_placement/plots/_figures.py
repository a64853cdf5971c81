"""_figures: in, rows and columns; out, a figure with panels, and one legend above them all.

Not known here: what is drawn in them.
"""

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

PANEL = (6.4, 3.6)
LARGEST = 200.0
"""Longest side of a figure [inch]; panels shrink beyond."""

_CROWDED = 0.2
"""Share of the band within which half of the lines crowd."""

_LETTER = 0.06
"""Width of a letter of a legend [inch]."""

_HANDLE = 7
"""Letters for which the sign before a label takes the room."""

STAR: dict[str, Any] = {
    "marker": "*",
    "color": "r",
    "markersize": 12,
    "markeredgecolor": "w",
    "linestyle": "none",
}
"""How a place that was found is marked."""


def panels(
    rows: int,
    columns: int,
    heights: list[float] | None = None,
    panel: tuple[float, float] = PANEL,
) -> tuple[Figure, Any]:
    """Figure with a grid of axes, outside pyplot, so that nothing stays open."""
    wide, high = panel[0] * columns, panel[1] * sum(heights or [1.0] * rows)
    figure = Figure(figsize=(min(wide, LARGEST), min(high, LARGEST)), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, height_ratios=heights)
    return figure, axes


def maps_beside(
    count: int, projection: str | None, width: float, least_height: float
) -> tuple[Figure, list[Any], Axes]:
    """Figure with panels for maps, two in a row, and at their right one panel as high as all.

    Width of a map and least height of the whole in inches.
    """
    rows, columns = max(1, -(-count // 2)), min(2, count)
    wide, high = PANEL
    size = (width * columns + wide, max(high * rows, least_height))
    # Names of axes in space stand out of their panels.
    layout = ConstrainedLayoutEngine(wspace=0.1 if projection else 0.02)
    figure = Figure(figsize=size, layout=layout)
    grid = figure.add_gridspec(rows, columns + 1, width_ratios=[width] * columns + [wide])
    places = itertools.product(range(rows), range(columns))
    maps = [figure.add_subplot(grid[one], projection=projection) for one in places]
    for unused in maps[count:]:
        unused.remove()
    return figure, maps[:count], figure.add_subplot(grid[:, -1])


def legend(figure: Figure, axes: Any) -> Figure:
    """One legend above all panels, where it covers nothing; empty panels say that they are."""
    entries = dict(_entries(axes))
    for axis in axes.flat:
        if not axis.has_data() and not axis.texts:
            axis.text(0.5, 0.5, "nothing of this kind is unknown", ha="center", va="center")
            axis.set_axis_off()
    if entries:
        handles, labels = list(entries.values()), list(entries)
        columns = _columns(labels, figure.get_figwidth())
        figure.legend(handles, labels, loc="outside upper center", ncols=columns, fontsize="small")
    return figure


def channel_panels(dataset: xr.Dataset, heights: list[float]) -> tuple[Figure, Any]:
    """Panels for channel pairs: sensors below, actuators and force levels beside each other.

    Heights are those of the panels of one pair, which stand below each other.
    """
    columns = dataset.sizes["actuator"] * len(runs(dataset))
    rows = dataset.sizes["sensor"] * len(heights)
    return panels(rows, columns, heights * dataset.sizes["sensor"])


def channels(axes: Any, dataset: xr.Dataset) -> Iterator[tuple[Axes, xr.Dataset]]:
    """Axes of each channel pair and force level with their data, named and scaled."""
    levels = runs(dataset)
    for row, column in np.ndindex(axes.shape):
        actuator, number = divmod(column, len(levels))
        (level, run), axis = levels[number], axes[row, column]
        channel = run.isel(sensor=row, actuator=actuator)
        yield axis, channel
        pair = f"sensor {channel['sensor'].item()}, actuator {channel['actuator'].item()}"
        axis.set_title(pair + level)
        frequency_axis(axis, channel["frequency"].values)


def runs(dataset: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """Lines of each force level, with a word for a title."""
    if "force_level" not in dataset.coords:
        return [("", dataset)]
    level = dataset["force_level"].values
    return [
        (f", {one:g} N", dataset.isel(frequency=np.flatnonzero(level == one)))
        for one in np.unique(level)
    ]


def frequency_axis(axis: Axes, lines: np.ndarray) -> None:
    """Name the axis; where most lines crowd at its lower end, it is logarithmic."""
    axis.set_xlabel("frequency [Hz]")
    if edges(lines)[0] > 0 and np.median(lines) < _CROWDED * lines.max():
        axis.set_xscale("log")


def edges(middles: np.ndarray) -> np.ndarray:
    """Edges midway between points, so that a colour stands for the points about its place."""
    if middles.size == 1:
        return middles[0] + np.array([-0.5, 0.5])
    between = (middles[1:] + middles[:-1]) / 2
    first, last = 2 * middles[0] - between[0], 2 * middles[-1] - between[-1]
    return np.concatenate([[first], between, [last]])


def on_two_lines(unit: str) -> str:
    """Break the unit of an FRF where it is longer than a panel is high."""
    return unit.replace(" per force", "\nper force")


def _columns(labels: list[str], width: float) -> int:
    """Greatest number of columns, up to three, in which the labels fit a width [inch]."""
    for count in (3, 2):
        columns = np.array_split(labels, count)
        letters = sum(max(map(len, some)) + _HANDLE for some in columns if some.size)
        if letters * _LETTER <= width:
            return count
    return 1


def _entries(axes: Any) -> Iterator[tuple[str, Any]]:
    for axis in axes.flat:
        handles, labels = axis.get_legend_handles_labels()
        yield from zip(labels, handles, strict=True)
