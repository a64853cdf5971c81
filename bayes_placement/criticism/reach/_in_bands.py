"""What any law leaves of the misfit of a band, all else refitted to that band to first order.

About a fit with the law free at each line residuals are linear in all other unknowns, and the law
is left out line by line. What a band then leaves follows from products of slopes and residuals,
which are sums over its lines: of those before each line, so that a band is a difference of two.
Fits with free laws come in, shares of any band go out; who asks for it is not known here.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ...inference.residuals import Problem, at_known_noise
from ..kept_fits import NONE, stored_or_computed
from ._at_port import Point, ReachOfPort
from ._free_law import AnyLaw, FreeOfLaw, Points, complex_residuals, in_parts, tells_phase
from ._of_modes import ReachOfEffect
from ._slopes import Curvatures, Slopes, Sparsity, measured_by_line

OF_LAW = 2
"""Numbers that a free law takes at each line, whatever they explain."""

MOST_NUMBERS = 2**22
"""Most products that are kept: of many lines and unknowns the ends of a band lie further apart."""

Edges = Int[np.ndarray, "edge"]
ByGroup = Float[np.ndarray, "group row column column"]
Products = Float[np.ndarray, "row column column"]
"""Products of slopes along all unknowns with each other, and last with residuals."""


class LeftInBands(NamedTuple):
    """Products summed over the lines before each edge of a band, of the model and with any law.

    Edges are numbers of lines, before each of which so many numbers were `measured`. The first row
    is of the model as given; the others, with points that are fits, of a `Reach` the rows of its
    `curves`.
    """

    frequency: Float[np.ndarray, "line"]
    edges: Edges
    measured: Int[np.ndarray, "edge"]
    products: Float[np.ndarray, "edge row column column"]
    points: Float[np.ndarray, "row unknown"]
    is_noise_known: Bool[np.ndarray, ""]

    def any_law(self, low: float, high: float) -> Float[np.ndarray, "row"]:
        """Share of the misfit above noise of a band [Hz] that any law could remove [1].

        Of unknown noise, which the model may have taken for a misfit, that of all residuals: a law
        takes as large a share of what is left as of the data.
        """
        first, last = self._ends(low, high)
        measured = self.measured[last] - self.measured[first]
        freed = OF_LAW * (self.edges[last] - self.edges[first])
        given, *left = _left(self.products[last] - self.products[first], self.points)
        if self.is_noise_known:
            above, gained = given - measured, given - np.array(left) - freed
        else:
            above, gained = given, given - np.array(left) * measured / max(measured - freed, 1)
        return np.clip(gained / above, 0.0, 1.0) if above > 0 else 0.0 * gained

    def _ends(self, low: float, high: float) -> tuple[int, int]:
        """Edges about the lines of a band."""
        first = np.searchsorted(self.frequency, low)
        last = np.searchsorted(self.frequency, high, side="right")
        before = np.searchsorted(self.edges, first, side="right") - 1
        return int(before), int(np.searchsorted(self.edges, last))


def _left(products: Products, points: Points) -> Float[np.ndarray, "row"]:
    """Sums of squares where cost and prior are least."""
    curvature = products[:, :-1, :-1] + np.eye(points.shape[1])
    pull = products[:, :-1, -1:] + points[..., None]
    moved = np.concatenate([-np.linalg.solve(curvature, pull), np.ones((len(points), 1, 1))], 1)
    return (moved.transpose(0, 2, 1) @ products @ moved)[:, 0, 0]


_LAYOUT = LeftInBands(NONE, NONE, NONE, NONE, NONE, NONE)
"""Its structure alone matters."""


def left_in_bands(
    problem: Problem, point: Point, reaches: Sequence[ReachOfPort | ReachOfEffect]
) -> LeftInBands | None:
    """Return what laws leave in bands; None of amplitudes and modes, and of two states."""
    noise = problem.experiment.noise
    is_noise_known = noise is not None and noise.deviation(problem.data) is not None
    problem, point = at_known_noise(problem, point)
    is_known = problem.baseline is None and tells_phase(problem)
    at_ports = [reached for reached in reaches if isinstance(reached, ReachOfPort)]
    if not is_known or len(at_ports) < len(reaches):
        return None

    def computed() -> LeftInBands:
        rows = 1 + sum(len(reached.points) for reached in at_ports)
        edges = _edges(problem, rows)
        parts = [_as_given(problem, point, edges)]
        parts += [_with_law(reached, edges) for reached in at_ports]
        products, points = zip(*parts, strict=True)
        summed = np.cumsum(np.concatenate(products, axis=1), axis=0)
        frequency = np.asarray(problem.experiment.frequency, float)
        measured = np.cumsum([0, *measured_by_line(problem)])[edges]
        from_zero = np.concatenate([0 * summed[:1], summed])
        of_rows = from_zero, np.concatenate(points)
        return LeftInBands(frequency, edges, measured, *of_rows, np.array(is_noise_known))

    return stored_or_computed(computed, _LAYOUT, problem, point, is_noise_known)


def _edges(problem: Problem, rows: int) -> Edges:
    lines, size = problem.data.z.shape[-1], rows * (problem.dimension + 1) ** 2
    return np.linspace(0, lines, min(lines, max(1, MOST_NUMBERS // size)) + 1).astype(int)


def _as_given(problem: Problem, point: Point, edges: Edges) -> tuple[ByGroup, Points]:
    """Products of the model as given at its fit, line group by line group."""
    residual, _, along, _ = problem.squares.along_groups(point[None])
    left, slopes = (complex_residuals(each, problem) for each in (residual, along))
    given = FreeOfLaw(left, np.zeros_like(left), Slopes(slopes, Sparsity.of(problem)))
    return _products(given, edges), point[None]


def _with_law(reached: ReachOfPort, edges: Edges) -> tuple[ByGroup, Points]:
    """Products at each place with a free law; what is held there is no unknown."""
    any_law, held = AnyLaw(reached.free), reached.free.held
    parts = [
        _products(any_law.free_of_law(points), edges)
        for points in in_parts(reached.points, reached.problem)
    ]
    products = np.delete(np.delete(np.concatenate(parts, axis=1), held, axis=-1), held, axis=-2)
    return products, np.delete(reached.points, held, axis=1)


def _products(free: FreeOfLaw, edges: Edges) -> ByGroup:
    groups = [slice(*ends) for ends in itertools.pairwise(edges)]
    return np.stack([_bordered(*free.at_lines(lines).normal_equations()) for lines in groups])


def _bordered(gradient: Points, curvature: Curvatures, squares: np.ndarray) -> Products:
    """Curvature with the gradient as its last row and column, and the sum of squares."""
    upper = np.concatenate([curvature, gradient[..., None]], axis=2)
    lower = np.concatenate([gradient, squares[:, None]], axis=1)
    return np.concatenate([upper, lower[:, None]], axis=1)
