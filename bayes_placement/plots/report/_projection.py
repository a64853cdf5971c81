"""A structure in space seen from one side, as points of a plane."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float, Real
from matplotlib.axes import Axes

from .._colours import FAINT
from .._instruments import FLAT

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
