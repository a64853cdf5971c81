"""What the data ask of a law at ports, all else fitted as far as residuals are linear in it.

Half the sum of squares and the prior are then a quadratic form of t alone, whatever the number of
channels: I / 2 |t|^2 + Re(p* t), less what the other unknowns take up.
"""

import functools
from typing import NamedTuple, TypeAlias

import numpy as np
from jaxtyping import Complex, Float, Int

from ..._shared.dimensions import Spectrum
from ...inference.engines.least_squares import NormalEquations
from ...laws.rows import NUMBERS, NetworkRows, Which
from ._filters import FilterRows
from ._free_law import AtPort, Free, Lines, Points, half_squares, in_parts

NETWORK, PLACE = NUMBERS, NUMBERS + 1
"""Coordinates of a row that are the number of its network and that of its place, and are held."""

OF_ROW = NUMBERS + 2

Rows: TypeAlias = NetworkRows | FilterRows
"""Laws of few numbers as arrays: of a factor its change t from 1, which is Z where h is zero."""

Each = Complex[np.ndarray, "... frequency"]
Networks = Int[np.ndarray, "network"]
"""Numbers of networks, or filters, that are tried."""

LARGEST = np.array([5.0] * NUMBERS + [np.inf] * 2)
"""Largest coordinates of a row."""


class Asked(NamedTuple):
    """Quadratic form of the cost in t, for each of some places.

    `information`, `pull` and `receptance` are of t at each line; `absorbed` is the whitened change
    of the pull on the other unknowns with t, `given` the same pull without a law. `constant` is the
    cost without a law, before the other unknowns are fitted, `log_volume` the logarithm of the
    volume that the data leave to these.
    """

    information: Float[np.ndarray, "place frequency"]
    pull: Lines
    receptance: Lines
    absorbed: Complex[np.ndarray, "place unknown frequency"]
    given: Float[np.ndarray, "place unknown"]
    constant: Float[np.ndarray, "place"]
    log_volume: Float[np.ndarray, "place"]

    @classmethod
    def at(cls, free: Free, points: Points, lines: Int[np.ndarray, "line"]) -> "Asked":
        """Read it at points, each at a place of its own, at some lines that stand for all.

        Points are fits with the law free at each line.
        """
        parts = (cls._at(free, part, lines) for part in in_parts(points, free.problem))
        return cls(*map(np.concatenate, zip(*parts, strict=True)))

    @classmethod
    def _at(cls, free: Free, points: Points, lines: Int[np.ndarray, "line"]) -> "Asked":
        whole = free.at(points)
        strength = free.typical(whole)
        slopes = free.slopes(points, strength, 1 - whole.receptance * strength)
        each = np.sqrt(strength.shape[1] / len(lines))  # each line counts for several
        at = AtPort(
            each * whole.free[..., lines],
            each * whole.slope[..., lines],
            whole.receptance[:, lines],
        )
        slopes = slopes.at_lines(lines, each)
        pulls, squares = slopes.products(at.free)
        prior = points.copy()
        prior[:, free.held] = 0.0
        root = np.linalg.cholesky(squares + np.eye(points.shape[1]))
        crossed = np.conj(slopes.crossed(at.slope))
        return cls(
            at.information(),
            at.pull(),
            at.receptance,
            np.linalg.solve(root.astype(complex), crossed),
            np.linalg.solve(root, (pulls + prior)[..., None])[..., 0],
            half_squares(at.free) + half_squares(points),
            -np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1),
        )


class LawsAsked:
    """What a descent over the numbers of many laws makes small, each at a place.

    `rows` are networks, or filters; `omega` are angular frequencies [rad/s]; `is_cut` says that
    laws are inserted.
    """

    def __init__(self, asked: Asked, rows: Rows, omega: Spectrum, is_cut: bool):
        self.asked, self.rows, self.omega, self.is_cut = asked, rows, omega, is_cut

    def cost(self, points: Points) -> np.ndarray:
        """Minus log posterior density of rows."""
        which, place = _which(points)
        stiffness = self.rows.stiffness(which, points[:, :NUMBERS], self.omega)
        strength, _ = closed(stiffness, self.asked.receptance[place], self.is_cut)
        return self._cost(points, place, strength)[1]

    def normal_equations(self, points: Points) -> NormalEquations:
        """Normal equations of rows."""
        which, place = _which(points)
        stiffness, slopes = self.rows.at_lines(which, points[:, :NUMBERS], self.omega)
        strength, softened = closed(stiffness, self.asked.receptance[place], self.is_cut)
        along = slopes * softened[:, None]
        left, cost = self._cost(points, place, strength)
        information = self.asked.information[place]
        taken = self._taken(along, place)
        conjugate = np.conj(along)
        squares = np.real((along * information[:, None]) @ conjugate.transpose(0, 2, 1))
        pull = self.asked.pull[place] + information * strength
        gradient = np.real(conjugate @ pull[..., None])[..., 0]
        gradient += points[:, :NUMBERS] - np.einsum("rxu,ru->rx", taken, left)
        curvature = squares - taken @ taken.transpose(0, 2, 1)
        return held_last(NormalEquations(cost, gradient, curvature, 2 * cost), 2)

    def costs_of_draws(self, which: Networks, count: int, place: int) -> np.ndarray:
        """Cost of draws of the numbers of networks at one place [network, draw].

        Dynamic stiffness is the same at all places, and computed once.
        """
        stiffness = self._drawn(tuple(which.tolist()), count)
        asked = self.asked
        strength, _ = closed(stiffness, asked.receptance[place], self.is_cut)
        taken = np.real(strength @ asked.absorbed[place].T)
        of_law = 0.5 * (np.abs(strength) ** 2 @ asked.information[place])
        of_law += np.real(strength @ np.conj(asked.pull[place]))
        cost = asked.constant[place] + of_law - half_squares(asked.given[place] + taken)
        prior = half_squares(draws(count))
        return np.nan_to_num(cost.reshape(len(which), count) + prior, nan=np.inf)

    @functools.lru_cache(maxsize=2)  # noqa: B019  of one objective, which lives as long
    def _drawn(self, which: tuple[int, ...], count: int) -> Lines:
        numbers = np.tile(draws(count), (len(which), 1))
        rows = np.repeat(np.array(which), count)
        return self.rows.stiffness(rows, numbers, self.omega)

    def _cost(self, points: Points, place: Which, strength: Lines) -> tuple[np.ndarray, np.ndarray]:
        """What pulls on the other unknowns, whitened, and the cost."""
        asked = self.asked
        left = asked.given[place] + self._taken(strength[:, None], place)[:, 0]
        of_law = 0.5 * asked.information[place] * np.abs(strength) ** 2
        of_law += np.real(np.conj(asked.pull[place]) * strength)
        prior = half_squares(points[:, :NUMBERS])
        return left, asked.constant[place] + of_law.sum(axis=1) - half_squares(left) + prior

    def _taken(self, along: Each, place: Which) -> Float[np.ndarray, "row direction unknown"]:
        """What changes of t [row, direction, frequency] take from the pull on other unknowns.

        One product of matrices for each place: copies of what it asks for each row are large.
        """
        absorbed = self.asked.absorbed
        taken = np.empty((*along.shape[:2], absorbed.shape[1]))
        for number in np.unique(place):
            rows = place == number
            flat = along[rows].reshape(-1, along.shape[-1])
            product = np.real(flat @ absorbed[number].T)
            taken[rows] = product.reshape(-1, *taken.shape[1:])
        return taken


def _which(points: Points) -> tuple[Which, Which]:
    """Network and place of each row."""
    return points[:, NETWORK].astype(int), points[:, PLACE].astype(int)


def draws(count: int) -> Points:
    """Standard normal numbers of laws."""
    return np.random.default_rng(0).standard_normal((count, NUMBERS))


def closed(stiffness: Each, receptance: Each, is_cut: bool) -> tuple[Each, Each]:
    """Strength t of a law, and its slope along the stiffness; one inserted is a compliance."""
    if is_cut:
        opened = 1 / (stiffness + receptance)
        return opened, -(opened**2)
    softened = 1 / (1 + receptance * stiffness)
    return stiffness * softened, softened**2


def held_last(normal: NormalEquations, count: int) -> NormalEquations:
    """Normal equations with the prior, and with so many numbers at the end, which are held."""
    rows, own = normal.gradient.shape
    gradient = np.concatenate([normal.gradient, np.zeros((rows, count))], axis=1)
    curvature = np.zeros((rows, own + count, own + count))
    curvature[:] = np.eye(own + count)
    curvature[:, :own, :own] += normal.curvature
    return normal._replace(gradient=gradient, curvature=curvature)
