"""Panels of a figure, what their axes have in common, and one legend for all of them."""

import itertools
import textwrap
from collections import ChainMap
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patheffects import withStroke
from matplotlib.transforms import BboxTransformTo, ScaledTranslation, blended_transform_factory

from .._shared.errors import InputError
from .._shared.labels import FORCE_LEVEL
from ._colours import DATA, PAPER, Style
from ._plain_figure import PlainFigure

Labelled = TypeVar("Labelled", xr.DataArray, xr.Dataset)

PANEL = (6.4, 3.6)
"""Width and height of a panel [inch]."""

PAGE = 11.0
"""Greatest height of a figure that stands on a page of A4 [inch]."""

MOST_SENSORS = 3
"""Sensors below each other in a figure of responses."""

MOST_COLUMNS = 3
"""Actuators and force levels beside each other on a page of responses."""

NARROW = 4.2
"""Width of a panel of responses that has others beside it [inch]."""

LONG = 3.0
"""Length over width of what maps show, from which they stand along each other."""

STRIP, MAP, MAST = 1.8, 2.7, 5.0
"""Height of a wide map, of another and of a high one, with title and numbers [inch]."""

LARGEST = 200.0
"""Greatest height of a figure [inch]; panels shrink beyond."""

BESIDE, BAR = 0.1, 0.12
"""Distance of the scale of colours from its map, and its width [inch]."""

CROWDED = 0.2
"""Share of the band within which half of the lines crowd."""

LETTER = 0.06
"""Width of a letter of a legend [inch]."""

LINE, USUAL_LINES = 0.17, 4
"""Height of a line of a legend [inch], and lines for which a figure has room beside its panels."""

HANDLE = 7
"""Letters for which the handle of a legend entry takes the room."""

LOGARITHM, DECIBELS = "log10 of ", 20.0
"""How units of logarithms of amplitudes begin, and decibels of a factor of ten."""

HALF_TURN = 180.0
"""Jump of a phase [degrees] that is none."""

STAR: Style = {
    "marker": "*",
    "color": DATA,
    "markersize": 12,
    "markeredgecolor": PAPER,
    "linestyle": "none",
}
"""Marker of an optimum or of a fitted place."""


SEEN = [withStroke(linewidth=2.5, foreground=PAPER)]
"""What makes a name or a mark stand out from what lies below it."""


class Panels(NamedTuple):
    """Axes to draw in, in rows and columns."""

    figure: Any
    """The figure."""
    axes: np.ndarray
    """Its axes [row, column]."""
    is_new: bool
    """Whether the figure was made here; else its layout is the caller's."""

    @property
    def only(self) -> Axes:
        """The axes of a figure of one panel."""
        return self.axes[0, 0]

    def with_legend(self) -> Figure:
        """Add one legend for all panels, and say in empty panels that they are.

        In a new figure the legend stands above the panels, where it covers nothing; in axes of the
        caller it is that of the first.
        """
        entries: dict[str, Artist] = {}
        for axes in self.axes.flat:
            handles, labels = axes.get_legend_handles_labels()
            entries |= dict(zip(labels, handles, strict=True))
            if axes.axison and not axes.has_data() and not axes.texts:
                axes.text(0.5, 0.5, "nothing of this kind is unknown", ha="center", va="center")
                axes.set_axis_off()
        labels, handles = list(entries), list(entries.values())
        width, height = self.figure.get_size_inches()
        if entries and self.is_new:
            width = width / self.figure.letters
            columns = _columns(labels, width)
            broken = [_broken(label, width) for label in labels]
            lines = max(sum(map(_lines, part)) for part in np.array_split(broken, columns))
            higher = height + LINE * self.figure.letters * max(0, lines - USUAL_LINES)
            self.figure.set_figheight(max(height, min(higher, PAGE)))
            place = {"loc": "outside upper center", "ncols": columns}
            self.figure.legend(handles, broken, fontsize="small", **place)
        elif entries:
            first = self.axes.flat[0]
            broken = [_broken(label, width * first.get_position().width) for label in labels]
            first.legend(handles, broken, fontsize="small")
        return self.figure


def panels(
    rows: int,
    columns: int,
    axes: object = None,
    *,
    heights: list[float] | None = None,
    size: tuple[float, float] = PANEL,
    projection: str | list[str | None] | None = None,
) -> Panels:
    """Return the axes of the caller, or those of a new figure outside pyplot.

    Axes of the caller stand row by row, one for each panel. Those of a new figure have relative
    heights of the rows, a size [inch] of each panel and a projection, or one for each row.
    """
    if axes is not None:
        return _panels_of_caller(np.array(axes, dtype=object).ravel(), rows, columns)
    width, height = size[0] * columns, size[1] * sum(heights or [1.0] * rows)
    figure = PlainFigure.on_page(width, min(height, LARGEST))
    grid = figure.add_gridspec(rows, columns, height_ratios=heights)
    by_row = projection if isinstance(projection, list) else [projection] * rows
    made = [
        figure.add_subplot(grid[place], projection=by_row[place[0]])
        for place in np.ndindex(rows, columns)
    ]
    return Panels(figure, np.array(made, dtype=object).reshape(rows, columns), is_new=True)


def _panels_of_caller(axes: np.ndarray, rows: int, columns: int) -> Panels:
    if axes.size != rows * columns:
        raise InputError(
            f"{axes.size} axes were given; {rows * columns} are needed, one for each panel. Make "
            f"them by matplotlib.pyplot.subplots({rows}, {columns}), or give none."
        )
    return Panels(axes[0].get_figure(), axes.reshape(rows, columns), is_new=False)


def maps_and_bars(
    count: int,
    axes: Sequence[Axes] | np.ndarray | None,
    projection: str | None,
    proportion: float,
    bars_height: float,
) -> Panels:
    """Return panels for maps, and below all one for bars, on a page.

    Maps stand two in a row; wide ones below each other, and high ones in one row. The proportion is
    width over height of what a map shows; bars are lower than `bars_height` [inch] where a page is
    too low. Axes of the caller are the maps and then the bars, and so is the result, in one row.
    """
    if axes is not None:
        return panels(1, count + 1, axes)
    is_long, is_high = proportion > LONG, proportion < 1 / LONG
    columns = max(1, min(1 if is_long else count if is_high else 2, count))
    rows = max(1, -(-count // columns))
    map_height = STRIP if is_long else MAST if is_high else MAP
    # Names of axes in space stand out of their panels.
    layout = ConstrainedLayoutEngine(wspace=0.1 if projection else 0.02)
    bars_height = min(bars_height, PAGE - rows * map_height)
    size = (PANEL[0] + NARROW, rows * map_height + bars_height)
    figure = PlainFigure.on_page(*size, layout)
    parts = figure.add_gridspec(2, 1, height_ratios=[map_height * rows, bars_height])
    # Each has a grid of its own, so that maps do not shrink by the names of bars.
    grid = parts[0].subgridspec(rows, columns)
    cells = list(itertools.product(range(rows), range(columns)))[:count]
    maps = [figure.add_subplot(grid[cell], projection=projection) for cell in cells]
    bars = figure.add_subplot(parts[1].subgridspec(1, 1)[0])
    return Panels(figure, np.array([[*maps, bars]], dtype=object), is_new=True)


def channel_panels(dataset: xr.Dataset, heights: list[float], axes: object = None) -> Panels:
    """Return panels for channel pairs: a row for each sensor, columns for actuators and levels.

    Where sensors are more than a page is high for, they go on at the right of the first ones; the
    rows of the result are those of all sensors all the same. Panels of one pair stand below each
    other with relative heights. Axes of the caller stand row by row.
    """
    columns = dataset.sizes["actuator"] * len(force_levels(dataset))
    count = dataset.sizes["sensor"]
    if axes is not None:
        return panels(count * len(heights), columns, axes)
    blocks = -(-count // MOST_SENSORS)
    below = -(-count // blocks)
    width = PANEL[0] if columns * blocks == 1 else NARROW
    size = (width, min(PANEL[1], PAGE / (below * sum(heights))))
    layout = panels(below * len(heights), columns * blocks, heights=heights * below, size=size)
    stacked = np.vstack(np.hsplit(layout.axes, blocks))
    for unused in stacked[count * len(heights) :].flat:
        unused.remove()
    return layout._replace(axes=stacked[: count * len(heights)])


def pages_of(dataset: xr.Dataset) -> list[dict[str, slice]]:
    """Return which sensors, actuators and force levels stand on each page."""
    levels = dataset.sizes.get(FORCE_LEVEL, 1)
    most = {
        "sensor": MOST_SENSORS,
        "actuator": max(1, MOST_COLUMNS // levels),
        FORCE_LEVEL: MOST_COLUMNS,
    }
    parts = [
        [{name: slice(start, start + count)} for start in range(0, dataset.sizes[name], count)]
        for name, count in most.items()
        if name in dataset.dims
    ]
    return [dict(ChainMap(*page)) for page in itertools.product(*parts)]


def worst_pairs(fit: xr.Dataset, count: int) -> list[dict[str, slice]]:
    """Return which sensor, actuator and force level the pairs of greatest error over noise are."""
    size = ((fit["error"] / fit["noise"]) ** 2).mean("frequency").fillna(-1.0)
    worst = np.argsort(-size.values, axis=None, kind="stable")[:count]
    numbers = zip(*np.unravel_index(worst, size.shape), strict=True)
    names = [str(name) for name in size.dims]
    return [
        {name: slice(n, n + 1) for name, n in zip(names, map(int, of), strict=True)}
        for of in numbers
    ]


def share_frequency(axes: np.ndarray, rows: int) -> None:
    """Name each channel pair above its first panel, and the frequency below its last."""
    for number, panel in np.ndenumerate(axes):
        place = number[0] % rows
        if place > 0:
            panel.set_title("")
        if place < rows - 1:
            panel.set_xlabel("")
            panel.tick_params(axis="x", labelbottom=False, which="both")


def channels(axes: np.ndarray, dataset: xr.Dataset) -> Iterator[tuple[Axes, xr.Dataset]]:
    """Give each axes [sensor, actuator and force level] its data, a title and a frequency axis."""
    levels = force_levels(dataset)
    for row, column in np.ndindex(axes.shape):
        actuator, number = divmod(column, len(levels))
        level, lines = levels[number]
        panel, channel = axes.item(row, column), lines.isel(sensor=row, actuator=actuator)
        yield panel, channel
        pair = f"sensor {channel['sensor'].item()}, actuator {channel['actuator'].item()}"
        panel.set_title(pair + level)
        frequency_axis(panel, channel["frequency"].values)


def force_levels(dataset: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """Return the lines of each force level, with the end of a title."""
    if FORCE_LEVEL not in dataset.dims:
        return [("", dataset)]
    forces = enumerate(dataset[FORCE_LEVEL].values)
    return [(f", {force:g} N", dataset.isel({FORCE_LEVEL: number})) for number, force in forces]


def frequency_axis(axes: Axes, lines: np.ndarray) -> None:
    """Name the frequency axis; where most lines crowd at its lower end, it is logarithmic."""
    axes.set_xlabel("frequency [Hz]")
    if edges(lines)[0] > 0 and np.median(lines) < CROWDED * lines.max():
        axes.set_xscale("log")


def edges(middles: np.ndarray) -> np.ndarray:
    """Return edges midway between points, so that a colour stands for the points around it."""
    if middles.size == 1:
        return middles[0] + np.array([-0.5, 0.5])
    between = (middles[1:] + middles[:-1]) / 2
    first, last = 2 * middles[0] - between[0], 2 * middles[-1] - between[-1]
    return np.concatenate([[first], between, [last]])


def color_bar(marks: ScalarMappable, panel: Axes, label: str) -> None:
    """Add the scale of the colours of a panel right beside it, below one in space."""
    if panel.name == "3d":
        # The layout reserves no space for the numbers of the z axis, at the right of a panel.
        panel.figure.colorbar(marks, ax=panel, label=label, shrink=0.8, location="bottom")
        return
    inches = panel.figure.dpi_scale_trans + ScaledTranslation(1.0, 0.0, BboxTransformTo(panel.bbox))
    beside = blended_transform_factory(inches, panel.transAxes)
    bar = panel.inset_axes((BESIDE, 0.0, BAR, 1.0), transform=beside)
    panel.figure.colorbar(marks, cax=bar, label=label)


def on_two_lines(unit: str) -> str:
    """Break the unit of an FRF where it is longer than a panel is high."""
    return unit.replace(" per force", "\nper force")


def in_decibels(values: Labelled, unit: str) -> tuple[Labelled, str]:
    """Logarithms of amplitudes in dB, with the name of their axis; all else as it is."""
    if not unit.startswith(LOGARITHM):
        return values, on_two_lines(unit)
    return DECIBELS * values, f"magnitude\n[dB re 1 {unit[unit.rfind('[') + 1 :]}"


def unbroken(phase: np.ndarray) -> np.ndarray:
    """Phase [degrees] without lines from one end of the axis to the other."""
    jumps = np.abs(np.diff(phase, prepend=phase[:1])) > HALF_TURN
    return np.where(jumps, np.nan, phase)


def phase_axis(panel: Axes) -> None:
    """Name the axis of a phase, and show one turn of it."""
    panel.set(yticks=[-HALF_TURN, 0.0, HALF_TURN], ylim=(-1.1 * HALF_TURN, 1.1 * HALF_TURN))
    panel.set_ylabel("phase [°]")


def _columns(labels: list[str], width: float) -> int:
    """Greatest number of columns, up to three, in which the labels fit a width [inch]."""
    for count in (3, 2):
        columns = np.array_split(labels, count)
        letters = sum(max(map(len, column)) + HANDLE for column in columns if column.size)
        if letters * LETTER <= width:
            return count
    return 1


def _broken(label: str, width: float) -> str:
    """Label in lines that fit a width [inch] behind the handle."""
    return textwrap.fill(label, max(HANDLE, int(width / LETTER) - 2 * HANDLE))


def _lines(label: str) -> int:
    return label.count("\n") + 1
