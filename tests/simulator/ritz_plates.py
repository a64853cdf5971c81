"""All modes of a thin rectangular plate by Ritz's method, its stiffness uneven where asked.

The deflection is a sum of products of polynomials, (1 - s)^a (1 + s)^b times Jacobi polynomials of
s, orthogonal on the plate (Bhat, J. Sound Vib. 102 (1985) 493): a is 0, 1 or 2 at a free, simply
supported or clamped edge. Independent of bayes_placement. SI units.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy.linalg
from numpy.polynomial import legendre
from scipy.special import eval_jacobi

from tests.simulator.fine_elements import NOTHING, Effect

ORDER, FINE = 20, 36
"""Polynomials along each side; enough of them also between places a twentieth of it apart."""

POWER = {"free": 0, "supported": 1, "clamped": 2}

Place = tuple[float, float]


@dataclass(frozen=True)
class Plate:
    """A thin plate of even thickness, in patches of the same size, `grid` of them along x and y."""

    length: float
    width: float
    thickness: float
    youngs_modulus: float
    density: float
    damping_ratio: float
    poisson_ratio: float = 0.33
    ends: str = "supported-supported"  # x = 0 and x = length
    sides: str = "supported-supported"  # y = 0 and y = width
    grid: tuple[int, int] = (4, 3)
    pieces: tuple[float, ...] = ()  # factors of the rigidity of the patches, along x first
    masses: tuple[tuple[Place, float], ...] = ()  # place [m], mass [kg]
    damping_factors: tuple[float, ...] = ()  # of the lowest modes; 1 for further ones
    order: int = ORDER  # polynomials along each side

    @property
    def mass(self) -> float:
        return self.density * self.thickness * self.length * self.width

    @property
    def rigidity(self) -> float:
        """E h^3 / (12 (1 - nu^2)) [N m]."""
        return self.youngs_modulus * self.thickness**3 / 12 / (1 - self.poisson_ratio**2)


@dataclass(frozen=True, eq=False)
class Side:
    """Polynomials along one side, of squares that integrate to its length."""

    length: float
    series: np.ndarray  # of Legendre polynomials, (term, function)

    def values(self, places: np.ndarray | float, derivative: int = 0) -> np.ndarray:
        """The polynomials, or a derivative [1/m^n], at places [m], of shape (place, function)."""
        local, scale = 2 * np.asarray(places) / self.length - 1, (2 / self.length) ** derivative
        series = legendre.legder(self.series, derivative)
        return scale * legendre.legvander(local, len(series) - 1) @ series

    def products(self, pieces: int) -> dict[tuple[int, int], np.ndarray]:
        """Integrals of products of derivatives over pieces, [piece, function, function]."""
        points, weights = legendre.leggauss(len(self.series) + 4)
        size = self.length / pieces
        places = size * (np.arange(pieces)[:, None] + (1 + points) / 2)
        rows = [self.values(places, order) for order in range(3)]
        return {
            (first, second): np.einsum(
                "q,pqi,pqj->pij", size / 2 * weights, rows[first], rows[second]
            )
            for first, second in ((0, 0), (1, 1), (2, 2), (0, 2))
        }


@lru_cache(maxsize=16)
def side(length: float, ends: str, order: int) -> Side:
    left, right = (POWER[end] for end in ends.split("-"))
    points, weights = legendre.leggauss(order + 4)
    edge = (1 + points) ** left * (1 - points) ** right
    values = np.stack(
        [edge * eval_jacobi(degree, 2 * right, 2 * left, points) for degree in range(order)], axis=1
    )
    values /= np.sqrt(weights @ values**2 / 2)
    last = order - 1 + left + right
    basis = legendre.legvander(points, last)
    series = (np.arange(last + 1)[:, None] + 0.5) * (basis.T * weights @ values)
    return Side(length, series)


@dataclass(frozen=True)
class PlatePlant:
    """All modes: natural angular frequencies [rad/s], mass-normalised shapes."""

    along: Side
    across: Side
    natural: np.ndarray
    shapes: np.ndarray  # (polynomial, mode)

    def rows(self, positions: Sequence[Place]) -> np.ndarray:
        """Shapes at positions [m], of shape (position, mode)."""
        return products(self.along, self.across, positions) @ self.shapes


def products(along: Side, across: Side, positions: Sequence[Place]) -> np.ndarray:
    """All products of polynomials at positions [m], of shape (position, product)."""
    x, y = np.array(positions, dtype=float).reshape(-1, 2).T
    each = along.values(x)[:, :, None] * across.values(y)[:, None, :]
    return each.reshape(x.size, along.series.shape[1] * across.series.shape[1])


def stiffness(plate: Plate, along: Side, across: Side, factors: np.ndarray) -> np.ndarray:
    """Bending stiffness over all products of polynomials, factors [patch along x, along y].

    Energy D/2 (w_xx^2 + w_yy^2 + 2 nu w_xx w_yy + 2 (1 - nu) w_xy^2).
    """
    x, y = along.products(plate.grid[0]), across.products(plate.grid[1])

    def integral(of_x: np.ndarray, of_y: np.ndarray) -> np.ndarray:
        size = of_x.shape[1] * of_y.shape[1]
        return np.einsum("pq,pij,qkl->ikjl", factors, of_x, of_y).reshape(size, size)

    mixed = integral(x[0, 2], np.swapaxes(y[0, 2], 1, 2))
    bent = integral(x[2, 2], y[0, 0]) + integral(x[0, 0], y[2, 2])
    twisted = 2 * (1 - plate.poisson_ratio) * integral(x[1, 1], y[1, 1])
    return plate.rigidity * (bent + twisted + plate.poisson_ratio * (mixed + mixed.T))


def plate_plant(plate: Plate, hidden: Effect = NOTHING) -> PlatePlant:
    """Modes of the plate proper: with its weak patch, nothing attached; scaled from a unit one."""
    softening = hidden if hidden.name == "local_stiffness_loss" else NOTHING
    unit = replace(
        plate, damping_ratio=0.0, damping_factors=(), youngs_modulus=1.0, density=1.0, masses=()
    )
    weight = unit.mass / plate.mass
    shares = tuple((place, mass * weight) for place, mass in plate.masses)
    plant = _plant(replace(unit, masses=shares), softening)
    squared = plate.rigidity / unit.rigidity * weight
    return replace(
        plant, natural=plant.natural * np.sqrt(squared), shapes=plant.shapes * np.sqrt(weight)
    )


@lru_cache(maxsize=32)
def _plant(plate: Plate, hidden: Effect) -> PlatePlant:
    along = side(plate.length, plate.ends, plate.order)
    across = side(plate.width, plate.sides, plate.order)
    count = plate.grid[0] * plate.grid[1]
    factors = np.array(plate.pieces or (1.0,) * count)
    if hidden is not NOTHING:
        factors[hidden["region"]] *= 1 - hidden["loss"]
    patches = factors.reshape(plate.grid[::-1]).T
    mass = plate.mass * np.eye(plate.order**2)
    rows = products(along, across, [place for place, _ in plate.masses])
    mass += rows.T * np.array([weight for _, weight in plate.masses]) @ rows
    squares, shapes = scipy.linalg.eigh(stiffness(plate, along, across, patches), mass)
    return PlatePlant(along, across, np.sqrt(np.maximum(squares, 0.0)), shapes)
