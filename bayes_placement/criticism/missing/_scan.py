"""An effect scanned through its prior, all else as it is: where it may be, before it is fitted."""

import itertools
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from ...inference.residuals import Problem
from ..screening_lines import sample
from ._at_channels import EffectAtData
from ._linear import Linear

MOST, LEAST = 1600, 400
"""Greatest number of points of a grid for all variants of a kind, and least for each."""

KEPT, TOGETHER = 128, 256
"""Points of a scan that are kept, those of the least predicted cost, and points that are scanned
together: residuals of all would be gigabytes."""


class Scan(NamedTuple):
    """An effect scanned through its prior, all else as it is without the effect.

    Points [point, own unknown] are in the coordinates of the effect; residuals [point, some] are
    logarithmic, in single precision. `predicted_cost` is that at each point once all else is
    fitted, as far as residuals are linear in it. `data` are those, of the lines of scans, that the
    effect changes, and that the residuals are of. None where these are all: then the residuals are
    of a sample, see `sample`.
    """

    points: np.ndarray
    residual: np.ndarray
    predicted_cost: np.ndarray
    data: np.ndarray

    def best(self, count: int) -> "Scan":
        """Return the points of least predicted cost, at most so many."""
        cost = np.nan_to_num(self.predicted_cost, nan=np.inf)
        order = np.argsort(cost, kind="stable")[:count]
        points, residual, cost = (values[order] for values in self[:-1])
        return Scan(points, residual, cost, self.data)

    def joined(self, other: "Scan") -> "Scan":
        """Return these points followed by others of the same data."""
        pairs = zip(self[:-1], other[:-1], strict=True)
        points, residual, cost = (np.concatenate(pair) for pair in pairs)
        return Scan(points, residual, cost, self.data)


ANY_SCAN = Scan(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0))
"""Its structure alone matters."""


def scan(
    part: EffectAtData, counts: dict[str, int], most: int, linear: Linear, solved: str | None = None
) -> Scan:
    """Scan an effect through the prior of its own unknowns.

    `part` is the effect at the lines of scans, `counts` the number of points along each of its
    unknowns, `solved` the name of the one that is solved for at each point of the others, if any.
    All other unknowns are refitted along the slopes of the logarithmic residuals without it.
    """
    grid = _grid(part.problem, counts, most)
    parts = (grid[begin : begin + TOGETHER] for begin in range(0, len(grid), TOGETHER))
    best = _scanned(part, next(parts), linear, solved)
    for points in parts:
        best = best.joined(_scanned(part, points, linear, solved)).best(KEPT)
    return best


def _scanned(part: EffectAtData, own: np.ndarray, linear: Linear, solved: str | None) -> Scan:
    """The best of some points."""
    own = own if solved is None else part.with_solved(own, solved)
    residual = part.logarithmic(own)
    cost = linear.cost(residual, part.data)
    data = np.zeros(0, dtype=int) if isinstance(part.data, slice) else part.data
    best = Scan(own, residual, cost, data).best(KEPT)
    kept = best.residual if data.size else sample(best.residual)
    return best._replace(residual=kept.astype(np.float32))


def other_places(problem: Problem, names: list[str]) -> np.ndarray:
    """Places of the unknowns that are not among those named."""
    slices = [problem.coordinates.places[name] for name in names]
    named = [place for part in slices for place in range(part.start, part.stop)]
    return np.setdiff1d(np.arange(problem.dimension), named)


def _grid(problem: Problem, counts: dict[str, int], most: int) -> np.ndarray:
    """Points in the middle of cells of equal prior probability; a random part of too many."""
    axes = [ndtri((np.arange(count) + 0.5) / count) for count in counts.values()]
    rows = (
        np.array(list(itertools.product(*axes))).reshape(-1, len(axes))
        if axes
        else np.zeros((1, 0))
    )
    if len(rows) > most:
        rows = rows[np.random.default_rng(0).choice(len(rows), most, replace=False)]
    sizes = [problem.coordinates.places[name] for name in counts]
    return np.repeat(rows, [place.stop - place.start for place in sizes], axis=1)
