"""Look of the figures of a report: small, with units, colours that follow the page."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float, Real
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._colours import FAINT, FLOOR, INK, Style
from .._instruments import FLAT
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


MOST_LINES = 700
"""Lines of a mesh that are drawn."""

_TILTED = np.array([[0.87, -0.5, 0.0], [0.25, 0.43, 0.87]])
"""View from above, x to the right and y to the left."""


class Projection(NamedTuple):
    """Rows of coordinates across and up, in x, y and z."""

    matrix: np.ndarray
    """Coordinates across and up per metre along x, y and z."""
    words: tuple[str, str]
    """Names of the axes of the plane."""

    @classmethod
    def of(cls, points: np.ndarray) -> "Projection":
        """The plane of a flat structure; a tilted view of any other."""
        size = np.ptp(points, axis=0)
        flat = [axis for axis in range(3) if size[axis] <= FLAT * size.max()]
        if not flat:
            return cls(_TILTED, ("seen from above, x to the right [m]", "z upwards [m]"))
        shown = [axis for axis in range(3) if axis not in flat]
        shown += [axis for axis in flat if axis not in shown][: 2 - len(shown)]
        across, up = sorted(shown[:2])
        return cls(np.eye(3)[[across, up]], (f"{'xyz'[across]} [m]", f"{'xyz'[up]} [m]"))

    def at(self, points: Real[np.ndarray, "*point 3"]) -> Float[np.ndarray, "2 *point"]:
        """Coordinates [2, point] of points [point, 3]."""
        return np.asarray(self.matrix @ np.asarray(points, float).T)

    def ellipse(self, draws: np.ndarray, deviations: float) -> np.ndarray:
        """Outline [2, corner] within which draws [draw, 3] lie, so many deviations wide."""
        flat = self.at(draws)
        values, vectors = np.linalg.eigh(np.atleast_2d(np.cov(flat)))
        angle = np.linspace(0.0, 2 * np.pi, 40)
        circle = np.stack([np.cos(angle), np.sin(angle)])
        axes = vectors * (deviations * np.sqrt(np.clip(values, 0.0, None)))
        return np.asarray(flat.mean(axis=1)[:, None] + axes @ circle)


def draw_outline(panel: Axes, outline: xr.Dataset, view: Projection) -> None:
    """Draw the lines of a structure, or its points, in a pale colour."""
    points = view.at(outline["point"].values)
    lines = outline["line"].values
    if not len(lines):
        panel.plot(
            *points[:, :: -(-points.shape[1] // MOST_LINES)],
            ".",
            color=FAINT,
            markersize=3,
            zorder=0,
        )
    else:
        ends = points[:, lines[:: -(-len(lines) // MOST_LINES)]]
        gaps = np.full((2, ends.shape[1], 1), np.nan)
        panel.plot(
            *np.concatenate([ends, gaps], axis=2).reshape(2, -1),
            color=FAINT,
            linewidth=0.8,
            zorder=0,
        )
    panel.set_aspect("equal")
    panel.set_xlabel(view.words[0])
    panel.set_ylabel(view.words[1])
