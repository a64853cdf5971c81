"""structure: in, a structure in space and places on it; out, both drawn in one panel.

Not known here: how anything was computed. A structure that lies in a plane is drawn in that plane.
"""

import itertools
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Float
from matplotlib.figure import Figure

from ..experiment.experiment import Experiment
from ..modes.finite_elements.interpolation import (
    Elements,
    Nearest,
    Scattered,
    reference_corners,
)
from ..modes.finite_elements.nodal_modes import nodal_of
from ..modes.modes import Modes
from ._figures import STAR

Panel = Any  # Axes, or Axes3D where the structure does not lie in a plane
Points = Float[np.ndarray, "point 3"]

LEAST_BRIGHT = 5.0
"""Least range of colours of a map [standard deviations]."""

MOST_LINES = 20_000
"""Greatest number of lines drawn of a mesh; of a larger one, every second or third and so on."""

_FLAT = 1e-6  # of the largest side, below which a structure has no extent
_MARGIN = 0.12  # of the largest side
_GREY = "0.8"
_CLEAR = 12.0  # points from the numbers to the name of an axis in space
_INSTRUMENT: dict[str, Any] = {
    "linestyle": "none",
    "markersize": 8,
    "markerfacecolor": "none",
    "markeredgecolor": "k",
}
_MARKERS = {"sensor": "^", "actuator": "v"}
_RING: dict[str, Any] = {
    "marker": "o",
    "linestyle": "none",
    "markersize": 15,
    "markerfacecolor": "none",
    "markeredgecolor": "r",
}


class View(NamedTuple):
    """Along which axes a structure is seen, and what part of space [m]."""

    axes: tuple[int, ...]
    low: np.ndarray
    high: np.ndarray

    @property
    def projection(self) -> str | None:
        """Projection of its panel: none where the structure lies in a plane."""
        return "3d" if len(self.axes) == 3 else None

    def seen(self, points: np.ndarray) -> np.ndarray:
        """Coordinates [axis, point] of points [point, 3]."""
        return np.asarray(points)[:, list(self.axes)].T


def view(points: Points) -> View:
    """See all of some points, without an axis along which they do not differ."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = high - low
    wide = [axis for axis in range(3) if size[axis] > _FLAT * size.max()]
    # A straight line or a single place is seen with one more axis, or two.
    filled = [*wide, *(axis for axis in (0, 2, 1) if axis not in wide)]
    axes = tuple(sorted(filled[: max(2, len(wide))]))
    margin = (_MARGIN if len(axes) < 3 else _MARGIN / 4) * max(size.max(), _FLAT)
    return View(axes, low - margin, high + margin)


def structure(axis: Panel, seen: View, experiment: Experiment) -> None:
    """Draw the mesh or the nodes of a structure in grey, and its instruments as recorded."""
    points, line = outline(experiment.structure.modes)
    axis.plot(*seen.seen(points), line, color=_GREY, markersize=3, zorder=1, label="structure")
    for kind, marker in _MARKERS.items():
        every = getattr(experiment, kind)
        places = np.array([one.recorded for one in every.values()])
        axis.plot(
            *seen.seen(places), marker=marker, label=f"{kind} as recorded", zorder=4, **_INSTRUMENT
        )
        for name, place in zip(every, seen.seen(places).T, strict=True):
            axis.text(*place, f"  {name}", fontsize="small", zorder=5, clip_on=True)


def suspects(figure: Figure, axis: Panel, seen: View, rows: pd.DataFrame, label: str) -> None:
    """Colour each place by its greatest score, and ring the greatest of all."""
    most = rows.groupby(["x", "y", "z"])["size"].max().sort_values()
    places = np.array(most.index.to_list())
    marks = axis.scatter(
        *seen.seen(places),
        c=most,
        s=np.clip(12000 / len(most), 14, 130),
        vmin=0.0,
        vmax=max(most.iloc[-1], LEAST_BRIGHT),
        zorder=2,
        **({"depthshade": False} if seen.projection else {}),
    )
    # The layout knows nothing of the numbers along z, at the right of a panel.
    beside = "bottom" if seen.projection else "right"
    figure.colorbar(marks, ax=axis, label=label, shrink=0.8, location=beside)
    axis.plot(*seen.seen(places[-1:]), zorder=3, label="greatest score", **_RING)


def fitted(axis: Panel, seen: View, place: tuple[float, float, float]) -> None:
    """Mark the place of an effect as fitted."""
    axis.plot(*seen.seen(np.array([place])), zorder=6, label="place as fitted", **STAR)


def dressed(axis: Panel, seen: View) -> None:
    """Name the axes, and show all of them in one scale."""
    size = seen.high - seen.low
    for number, name in zip(seen.axes, ("x", "y", "z"), strict=False):
        limits = (seen.low[number], seen.high[number])
        axis.set(**{f"{name}lim": limits, f"{name}label": f"{'xyz'[number]} [m]"})
        axis.locator_params(axis=name, nbins=2 + 2 * (size[number] > 0.3 * size.max()))
    if seen.projection:
        axis.set_box_aspect(size)
        axis.tick_params(labelsize="small")
        axis.xaxis.labelpad = axis.yaxis.labelpad = _CLEAR
    else:
        axis.set_aspect("equal")


def outline(modes: Modes) -> tuple[Points, str]:
    """Lines of the mesh with gaps of NaN between them, or nodes; and how to draw them."""
    nodal = nodal_of(modes)
    read = None if nodal is None else nodal.interpolation
    if isinstance(read, Nearest | Scattered):
        return np.asarray(read.centre), "."
    if isinstance(read, Elements):
        corners = reference_corners(read.edges.shape[2], read.simplex)
        return _lines(np.asarray(read.origin), np.asarray(read.edges), corners, read.simplex), "-"
    low, high = np.array(modes.bounds())
    whole = reference_corners(3, simplex=False)
    return _lines(low[None], np.diag(high - low)[None], whole, simplex=False), "-"


def _lines(origin: np.ndarray, edges: np.ndarray, corners: np.ndarray, simplex: bool) -> Points:
    """Edges of cells: in a box between corners that differ in one coordinate, else between all."""
    pairs = [
        pair
        for pair in itertools.combinations(range(len(corners)), 2)
        if simplex or np.abs(corners[pair[0]] - corners[pair[1]]).sum() == 1
    ]
    place = origin[:, None] + corners @ edges.mT
    ends = place[:, np.array(pairs)].reshape(-1, 2, 3)
    ends = ends[:: -(-len(ends) // MOST_LINES)]
    gaps = np.full((len(ends), 1, 3), np.nan)
    return np.concatenate([ends, gaps], axis=1).reshape(-1, 3)


def extent(experiment: Experiment | None, rows: pd.DataFrame) -> Points:
    """Corners of the structure, or the places on it where it is not known [m]."""
    if experiment is None:
        return rows[["x", "y", "z"]].to_numpy()
    return np.array(experiment.structure.modes.bounds())
