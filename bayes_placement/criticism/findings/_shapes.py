"""Mode shapes of a fitted model at points by which its structure is drawn."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from ...experiment.experiment import Experiment
from ...experiment.natural_modes import natural_modes
from ...modes.finite_elements.outline import outline
from ...positions.bounds import in_space
from ..fitted import with_arrays

POINTS_ON_A_LINE = 121

MOST_LINES = 2500
"""Lines of a mesh, or nodes, that are kept."""

MOST_MODES = 6

BEYOND = 1.3
"""Natural frequencies up to so many times the greatest line are sought."""


def outline_of(experiment: Experiment) -> xr.Dataset:
    """Return points of a structure [m] and the pairs of them that are joined.

    Parameters
    ----------
    experiment
        The experiment.
    """
    modes = experiment.structure.modes
    if not in_space(modes.bounds()):
        low, high = map(float, modes.bounds())
        points = np.zeros((POINTS_ON_A_LINE, 3))
        points[:, 0] = np.linspace(low, high, POINTS_ON_A_LINE)
        numbers = np.arange(POINTS_ON_A_LINE)
        lines = np.stack([numbers[:-1], numbers[1:]], axis=1)
        return _labelled(points, lines, on_a_line=True)
    drawn, style = outline(modes)
    if style == "-":
        ends = drawn.reshape(-1, 3, 3)[:, :2]
        ends = ends[:: -(-len(ends) // MOST_LINES)]
        points, numbers = np.unique(ends.reshape(-1, 3), axis=0, return_inverse=True)
        lines = numbers.reshape(-1, 2)
    else:
        points, lines = drawn[:: -(-len(drawn) // MOST_LINES)], np.zeros((0, 2), int)
    return _labelled(points, lines, on_a_line=False)


def shapes(experiment: Experiment, values: Mapping[str, float], outline: xr.Dataset) -> xr.Dataset:
    """Return the first natural modes, up to a little above the band, at the points of an outline.

    Parameters
    ----------
    experiment
        The experiment with its effects.
    values
        Value of every unknown, elements of arrays one by one.
    outline
        What `outline_of` returned.
    """
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


def _labelled(points: np.ndarray, lines: np.ndarray, *, on_a_line: bool) -> xr.Dataset:
    variables = {
        "point": (("place", "axis"), points, {"units": "m"}),
        "line": (("line_number", "end"), lines),
    }
    return xr.Dataset(variables, coords={"axis": ["x", "y", "z"]}).assign_attrs(
        on_a_line=int(on_a_line)
    )
