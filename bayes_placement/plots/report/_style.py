"""Look of the figures of a report: small, with units, colours that follow the page."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._colours import FLOOR, INK, Style
from .._plain_figure import HIGHEST, WIDTH, PlainFigure
from ._svg import svg_of
from .content import Drawing, Table

MOST_POINTS = 500
"""Points of a curve that are drawn; the data hold all."""

_LOOK: Style = {
    "font.size": 8.5,
    "axes.titlesize": 8,
    "axes.titlelocation": "left",
    "axes.edgecolor": FLOOR,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "xtick.color": INK,
    "ytick.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "axes.formatter.use_mathtext": False,
    "axes.formatter.useoffset": False,
    "path.simplify_threshold": 0.5,
}


@contextmanager
def look() -> Iterator[None]:
    """Draw within as figures of a report look."""
    with rc_context(_LOOK):
        yield


def panels(rows: int, columns: int, height: float, **settings: Any) -> tuple[Figure, np.ndarray]:
    """Return a figure outside pyplot with panels [row, column].

    Each has a height [inch], less where a page is too low for all of them.
    """
    figure = PlainFigure.on_page(WIDTH, min(HIGHEST, max(1.4, height * rows)))
    axes = figure.subplots(rows, columns, squeeze=False, **settings)
    return figure, axes


def legend(figure: Figure, axes: np.ndarray) -> None:
    """Put one legend above all panels, where it hides nothing."""
    entries: dict[str, Artist] = {}
    for panel in axes.flat:
        handles, labels = panel.get_legend_handles_labels()
        entries |= dict(zip(labels, handles, strict=True))
    if entries:
        place: Style = {"loc": "outside upper left", "ncols": min(4, len(entries))}
        figure.legend(list(entries.values()), list(entries), **place)


def drawing(figure: Figure, data: Table | None) -> Drawing:
    """Return a figure as SVG that follows the page, with its numbers."""
    return Drawing(svg_of(figure), data, follows_theme=True)


def thinned(curve: np.ndarray) -> np.ndarray:
    """Numbers of points of a curve that are drawn: the least and the greatest of each stretch.

    A peak of one line is not lost so.
    """
    if curve.size <= MOST_POINTS:
        return np.arange(curve.size)
    stretches = np.array_split(np.arange(curve.size), MOST_POINTS // 2)
    extremes = [
        stretch[[np.argmin(curve[stretch]), np.argmax(curve[stretch])]] for stretch in stretches
    ]
    return np.unique(extremes)


def decade_labels(panel: Axes) -> None:
    """Write the numbers of a logarithmic axis as they are, without raised digits."""
    panel.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    panel.yaxis.set_minor_formatter(lambda value, _: "")
