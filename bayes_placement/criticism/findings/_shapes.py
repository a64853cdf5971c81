"""Mode shapes of a fitted model at points by which its structure is drawn."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...experiment.experiment import Experiment
from ...experiment.natural_modes import natural_modes
from ...modes.finite_elements.outline import outline
from ...positions.bounds import in_space
from ..fitted import with_arrays

if TYPE_CHECKING:
    import xarray as xr

POINTS_ON_A_LINE = 121

MOST_LINES = 2500
"""Lines of a mesh, or nodes, that are kept."""

FEWEST_LINES = 240
"""Lines at least, into which those of a frame are divided, so that they bend."""

SAME = 1e-9
"""Share of the size of a structure within which two points are one."""

MOST_MODES = 6

BEYOND = 1.3
"""Natural frequencies up to so many times the greatest line are sought."""


class Outline(NamedTuple):
    """Points of a structure and the lines between them."""

    points: np.ndarray
    """Points [place, 3] [m]."""
    lines: np.ndarray
    """Numbers of both ends of each line [line, 2]."""
    on_a_line: bool
    """Whether the structure is a line along x."""


def outline_of(experiment: Experiment) -> "xr.Dataset":
    """Return the points of a structure [m] and the pairs of them that are joined, with labels."""
    return _labelled(*points_and_lines(experiment))


def points_and_lines(experiment: Experiment) -> Outline:
    """Return the points of a structure [m] and the pairs of them that are joined."""
    modes = experiment.structure.modes
    if not in_space(modes.bounds()):
        low, high = map(float, modes.bounds())
        points = np.zeros((POINTS_ON_A_LINE, 3))
        points[:, 0] = np.linspace(low, high, POINTS_ON_A_LINE)
        numbers = np.arange(POINTS_ON_A_LINE)
        lines = np.stack([numbers[:-1], numbers[1:]], axis=1)
        return Outline(points, lines, on_a_line=True)
    drawn, style = outline(modes)
    if style == "-":
        ends = drawn.reshape(-1, 3, 3)[:, :2]
        ends = ends[:: -(-len(ends) // MOST_LINES)]
        points, lines = _joined(_subdivided(ends))
    else:
        points, lines = drawn[:: -(-len(drawn) // MOST_LINES)], np.zeros((0, 2), int)
    return Outline(points, lines, on_a_line=False)


def _subdivided(ends: np.ndarray) -> np.ndarray:
    """Ends [line, end, 3] of shorter lines, where there are so few that they would not bend."""
    parts = max(1, FEWEST_LINES // len(ends))
    along = np.linspace(0.0, 1.0, parts + 1)[:, None]
    points = ends[:, :1] + along * (ends[:, 1:] - ends[:, :1])
    return np.stack([points[:, :-1], points[:, 1:]], axis=2).reshape(-1, 2, 3)


def _joined(ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points that differ [point, 3], and the numbers of both ends of each line [line, 2]."""
    size = float(np.ptp(ends.reshape(-1, 3), axis=0).max()) or 1.0
    cells = np.round(ends.reshape(-1, 3) / (SAME * size))
    _, first, numbers = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    return ends.reshape(-1, 3)[first], numbers.reshape(-1, 2)


def shapes(
    experiment: Experiment, values: Mapping[str, float], outline: "xr.Dataset"
) -> "xr.Dataset":
    """Return the first natural modes, up to a little above the band, at the points of an outline.

    The outline is that of `outline_of`; elements of arrays are given one by one.
    """
    import xarray as xr

    structure = experiment.fix(with_arrays(experiment, values)).structure
    points = outline["point"].values
    at = points[:, 0] if outline.attrs["on_a_line"] else points
    modes = natural_modes(structure, at, BEYOND * float(np.max(experiment.frequency)), MOST_MODES)
    variables = {
        "natural_frequency": ("mode", modes.frequency, {"units": "Hz"}),
        "shape": (("mode", "place", "axis"), modes.shape, {"units": "1"}),
    }
    return xr.Dataset(variables, coords={"axis": ["x", "y", "z"]}).assign_attrs(
        axes=[int(axis) for axis in structure.modes.axes]
    )


def _labelled(points: np.ndarray, lines: np.ndarray, on_a_line: bool) -> "xr.Dataset":
    import xarray as xr

    variables = {
        "point": (("place", "axis"), points, {"units": "m"}),
        "line": (("line_number", "end"), lines),
    }
    return xr.Dataset(variables, coords={"axis": ["x", "y", "z"]}).assign_attrs(
        on_a_line=int(on_a_line)
    )
