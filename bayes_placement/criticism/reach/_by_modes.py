"""What any law could do at very many places: sums over channels are taken once, by the modes.

A law changes the FRF from actuator a to sensor s by -w H_sp H_pa t, and both receptances of a place
p are products of its shapes with the motion under unit forces. So all sums over channels, of these
changes with residuals and with each other, are forms of the shapes at the place, whose coefficients
are the same for all places: a place costs products over modes, however many sensors there are.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from ...inference.residuals import Problem
from ._free_factor import Responses
from ._free_law import Point, complex_residuals, over
from ._motions import PLACES, Motions, Shapes, form
from ._slopes import Sparsity

LINES = 64
"""Lines at which motions are kept together: those of many sensors at all lines are gigabytes."""

BEST = 100
"""Places of the scan in single precision that are computed again in double."""


class SumsOverChannels(NamedTuple):
    """Sums over channels at places, line by line.

    `information` are squares of what a law changes; `pulls` its products with the residuals, and
    with their slopes along each unknown.
    """

    information: Float[np.ndarray, "place frequency"]
    pulls: Complex[np.ndarray, "product place frequency"]


class Tables(NamedTuple):
    """Coefficients of the forms of shapes.

    `driven` is motion under the force of each actuator; `pulls` are sums over its sensors of
    motions with residuals and their slopes, `squares` those of motions with each other, of each
    pair of coordinates once.
    """

    driven: Complex[np.ndarray, "actuator coordinate frequency"]
    pulls: Complex[np.ndarray, "actuator product coordinate frequency"]
    squares: Float[np.ndarray, "actuator pair frequency"]

    def single(self) -> "Tables":
        """Return them in single precision."""
        return Tables(
            self.driven.astype(np.complex64),
            self.pulls.astype(np.complex64),
            self.squares.astype(np.float32),
        )

    def at(self, shapes: Shapes) -> SumsOverChannels:
        """Sums at places."""
        shapes = shapes.astype(self.squares.dtype)
        first, second = np.triu_indices(shapes.shape[1])
        pairs = shapes[:, first] * shapes[:, second]
        information, pulls = 0.0, 0.0
        for driven, of_pulls, squares in zip(*self, strict=True):
            to_place = form(shapes, driven)
            information = information + (pairs @ squares) * (to_place.real**2 + to_place.imag**2)
            pulls = pulls - np.conj(to_place) * form(shapes, of_pulls)
        return SumsOverChannels(np.asarray(information), np.asarray(pulls))


class ScanByModes:
    """What any law could do at places, all unknowns of the structure linear at a point.

    Unknowns of instruments are held: each changes the few channels of its own.

    The problem is without the port; the point is its fit.
    """

    def __init__(self, problem: Problem, point: Point):
        self.motions = Motions(problem, point)
        self._read(problem, point)
        self.tables = self._tables()

    def _read(self, problem: Problem, point: Point) -> None:
        """Residuals, their slopes, and the quadratic form of the cost without a law."""
        residual, response = (each[0] for each in Responses(problem).at(point[None]))
        sparsity, moved = Sparsity.of(problem), problem.coordinates.places
        columns = [
            column
            for name, place in moved.items()
            for column in range(place.start, place.stop)
            if name.startswith("structure.") and sparsity.changes[column].any()
        ]
        along = complex_residuals(problem.squares.along_groups(point[None]).slopes, problem)[0]
        slopes = along[sparsity.group[columns]] * sparsity.changes[columns].any(-1)
        self._response, self._right = response, np.concatenate([residual[None], slopes])
        flat = self._right.reshape(len(self._right), -1)
        products = np.real(np.conj(flat) @ flat.T)
        self.cost = 0.5 * (products[0, 0] + float(point @ point))
        self.pull = products[0, 1:] + point[columns]
        self.curvature = products[1:, 1:] + np.eye(len(columns))

    def _tables(self) -> Tables:
        """Coefficients of all lines, a few lines at a time."""
        count, parts = self._right.shape[-1], []
        for start in range(0, count, LINES):
            lines = np.minimum(np.arange(start, start + LINES), count - 1)
            moved = self.motions.at_lines(lines)[..., : count - start]
            parts.append(self._table(moved, slice(start, start + LINES)))
        joined = (np.concatenate(each, axis=-1) for each in zip(*parts, strict=True))
        return Tables(*map(np.ascontiguousarray, joined))

    def _table(
        self, moved: Complex[np.ndarray, "coordinate instrument line"], lines: slice
    ) -> Tables:
        """Coefficients at some lines from motions."""
        read, driven = np.split(moved, [self.motions.sensors], axis=1)
        response = np.einsum("sk,kal->sal", self.motions.at_sensors, driven)
        channels = *response.shape[:2], -1
        weight = over(self._response[:, lines].reshape(channels), response)
        right = self._right[:, :, lines].reshape(len(self._right), *response.shape)
        pulls = np.einsum(
            "ksl,sal,qsal->aqkl", np.conj(read), np.conj(weight), right, optimize=True
        )
        squares = np.stack([_squares(read, weight[:, each]) for each in range(driven.shape[1])])
        return Tables(np.swapaxes(driven, 0, 1), pulls, squares)

    def costs(self, shapes: Shapes) -> Float[np.ndarray, "place"]:
        """Minus log posterior density with a law that is free at each line.

        In single precision, and in double at the best hundred places.
        """
        costs = self._costs(self.tables.single(), shapes)
        best = np.argsort(costs)[:BEST]
        costs[best] = self._costs(self.tables, shapes[best])
        return costs

    def _costs(self, tables: Tables, shapes: Shapes) -> Float[np.ndarray, "place"]:
        parts = np.array_split(shapes, max(1, -(-len(shapes) // PLACES)))
        return np.concatenate([self._of_products(tables.at(part)) for part in parts])

    def _of_products(self, products: SumsOverChannels) -> Float[np.ndarray, "place"]:
        information, pull, crossed = products.information, products.pulls[0], products.pulls[1:]
        share = over(1.0, information)
        gained = np.sum((pull.real**2 + pull.imag**2) * share, axis=1, dtype=float)
        gradient = np.repeat(self.pull[None], len(pull), axis=0)
        curvature = np.repeat(self.curvature[None], len(pull), axis=0)
        for row, one in enumerate(crossed):
            shared = np.conj(one) * share
            gradient[:, row] -= np.einsum("pf,pf->p", shared, pull).real
            for column, other in enumerate(crossed):
                curvature[:, row, column] -= np.einsum("pf,pf->p", shared, other).real
        step = np.linalg.solve(curvature, gradient[..., None])[..., 0]
        return self.cost - 0.5 * gained - 0.5 * np.einsum("pu,pu->p", gradient, step)


def _squares(read: np.ndarray, weight: np.ndarray) -> Float[np.ndarray, "pair frequency"]:
    """Sums over sensors of weighted motions [coordinate, sensor, line] with each other."""
    weighted = np.moveaxis(read * weight, -1, 0)
    parts = np.concatenate([weighted.real, weighted.imag], axis=-1)
    square = parts @ parts.swapaxes(1, 2)
    first, second = np.triu_indices(square.shape[-1])
    return np.ascontiguousarray((square[:, first, second] * (2 - (first == second))).T)
