"""A law that is free at each line: what any law at a port could do, whatever it is.

On one port residuals are r + a t at each line, with one complex number t = Z / (1 + h Z), the
receptance h of the port, and a = h_op h_pi over the deviation of the noise. So t follows from least
squares at each line, and all else is fitted with it left out (variable projection, Golub and
Pereyra, SIAM J. Numer. Anal. 10 (1973) 413, doi:10.1137/0710036).
"""

import functools
from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Complex, Float, Inexact

from ...inference.engines.least_squares import STEP, NormalEquations
from ...inference.residuals import Problem
from ..kept_fits import stored_or_computed
from ._slopes import Channels, Curvatures, Slopes, SomeLines, Sparsity, by_line

Point = Float[np.ndarray, "unknown"]
OfPoints = Float[np.ndarray, "point"]
Points = Float[np.ndarray, "point unknown"]
"""Coordinates of a problem."""

Lines = Complex[np.ndarray, "point frequency"]
"""A complex number at each line."""

MOST_SLOPES = 2**22
"""Slopes that are taken together: those of many places and channels are gigabytes."""

SOFT = 1e-2
"""Size of h Z of the law by which a is read."""


class AtPort(NamedTuple):
    """What a law of one number at each line does, at points: in full, or about one law.

    `free` are residuals r without it, `slope` their change a with t, and the receptance h is that
    of the port; of a cut the dynamic stiffness against opening it.
    """

    free: Channels
    slope: Channels
    receptance: Lines

    def information(self) -> Float[np.ndarray, "point frequency"]:
        """Inverse of the variance of the real part of t, and of the imaginary part."""
        return np.sum(np.abs(self.slope) ** 2, axis=1)

    def pull(self) -> Lines:
        """Gradient of half the sum of squares along t, at no law."""
        return np.sum(np.conj(self.slope) * self.free, axis=1)

    def best(self) -> Lines:
        """The t of least squares at each line; zero where the data do not see the port."""
        return -over(self.pull(), self.information())

    def left(self, strength: Lines) -> Channels:
        """Residuals with a law."""
        return self.free + self.slope * strength[:, None]


@runtime_checkable
class Free(Protocol):
    """What may be any at each line: a law on a port, or a factor on channels."""

    problem: Problem
    held: list[int]

    def at(self, points: Points) -> AtPort:
        """What it does, at points."""

    def about(self, points: Points, stiffness: Lines) -> AtPort:
        """Return the same, to second order about a law."""

    def residuals(self, points: Points, numerator: Lines, denominator: Lines) -> Channels:
        """Residuals with a law, numerator over denominator."""

    @property
    def sparsity(self) -> Sparsity:
        """Which residuals each unknown changes; none what is held."""

    def slopes(self, points: Points, numerator: Lines, denominator: Lines) -> Slopes:
        """Slopes of these along all unknowns, the law held; zero along what is held."""

    def typical(self, at: AtPort) -> Lines:
        """Strength about which residuals are taken as linear in all else."""

    def released(self) -> "Free":
        """Return the same with nothing held."""


class FreeLaw:
    """An experiment with an effect on one port whose law may be any.

    The port is the last one of the structure of the problem; descents do not change `held`
    coordinates.
    """

    def __init__(self, problem: Problem, held: Sequence[int] = ()):
        self.problem, self.held = problem, list(held)
        self._lines = problem.data.z.shape[-1]

    @functools.cached_property
    def _soft(self) -> float:
        """A law so soft that h Z is about `SOFT`."""
        return stored_or_computed(self._calibrated, 0.0, self.problem, tuple(self.held))

    def at(self, points: Points) -> AtPort:
        """What a law does, read from none, a soft one and a pole, which holds the port."""
        return self._read_with(points, self._soft)

    def about(self, points: Points, stiffness: Lines) -> AtPort:
        """Return the same, which is so for any law."""
        return self.at(points)

    def _read_with(self, points: Points, soft: float) -> AtPort:
        laws = [(0.0, 1.0), (soft, 1.0), (1.0, 0.0)]
        shape = (len(points), len(laws), 2, self._lines)
        filled = np.broadcast_to(np.array(laws, complex)[..., None], shape)
        residual = complex_residuals(self.problem.with_laws(points, filled), self.problem)
        free = residual[:, 0]
        # a z / (1 + h z), and a / h of the pole.
        by_soft, by_pole = residual[:, 1] - free, residual[:, 2] - free
        slope = over(by_soft * by_pole, (by_pole - by_soft) * soft)
        moved = np.sum(np.abs(by_pole) ** 2, axis=1)
        receptance = over(np.sum(np.conj(by_pole) * slope, axis=1), moved)
        return AtPort(free, slope, receptance)

    def size(self) -> float:
        """Median of 1 / |h| over the lines, at the medians of all priors."""
        return SOFT**-1 * self._soft

    def residuals(self, points: Points, numerator: Lines, denominator: Lines) -> Channels:
        """Residuals with a law, numerator over denominator."""
        laws = np.stack([numerator, denominator], axis=1)[:, None]
        return complex_residuals(self.problem.with_laws(points, laws)[:, 0], self.problem)

    def slopes(self, points: Points, numerator: Lines, denominator: Lines) -> Slopes:
        """Slopes of the residuals along all unknowns, the law held; zero along what is held."""
        groups = self.problem.squares.column_groups
        directions = groups.directions()
        steps = np.concatenate([np.zeros((1, points.shape[1])), STEP * directions])
        around = (points[:, None] + steps).reshape(-1, points.shape[1])
        law = np.repeat(np.stack([numerator, denominator], axis=1), len(steps), axis=0)
        residual = self.problem.with_laws(around, law[:, None])[:, 0]
        residual = residual.reshape(len(points), len(steps), -1)
        residual[:, 1:] -= residual[:, :1]  # in place: it is large
        residual /= STEP
        return Slopes(complex_residuals(residual[:, 1:], self.problem), self.sparsity)

    @functools.cached_property
    def sparsity(self) -> Sparsity:
        """Which residuals each unknown changes; none what is held."""
        return Sparsity.of(self.problem, self.held)

    def typical(self, at: AtPort) -> Lines:
        """The free law."""
        return at.best()

    def released(self) -> "FreeLaw":
        """Return the same with nothing held."""
        return FreeLaw(self.problem)

    def _calibrated(self) -> float:
        point, soft = np.zeros((1, self.problem.dimension)), 1.0
        if not (tells_phase(self.problem) and self._felt(point, soft) > 0):
            # Ends of a strut at the same place feel nothing.
            point[:, self.held] = np.linspace(-0.5, 0.5, len(self.held))
        if not tells_phase(self.problem):
            return SOFT * self._half_way(point)
        for _ in range(3):  # rounding is great where the first is far too soft or too hard
            size = self._felt(point, soft)
            soft = SOFT / size if size > 0 else soft
        return soft

    def _felt(self, point: Points, soft: float) -> float:
        """Median of |h| over the lines."""
        return float(np.median(np.abs(self._read_with(point, soft).receptance)))

    def _half_way(self, point: Points) -> float:
        """Size of the law that moves amplitudes half as far as a pole does."""
        sizes = np.geomspace(1e-12, 1e12, 193)
        numerators = np.concatenate([[0.0, 1.0], sizes])
        denominators = np.concatenate([[1.0, 0.0], np.ones(sizes.size)])
        each = np.stack([numerators, denominators], axis=1)[..., None]
        laws = np.broadcast_to(each, (*each.shape[:2], self._lines)).astype(complex)
        residual = self.problem.with_laws(point, laws[None])[0]
        moved = np.linalg.norm(residual[1:] - residual[0], axis=1)
        return float(sizes[np.argmax(moved[1:] >= 0.5 * moved[0])])


class FreeOfLaw(NamedTuple):
    """Residuals `left` by the best law at each line, their change with it, and along all else."""

    left: Channels
    slope: Channels
    along: Slopes

    def at_lines(self, lines: SomeLines) -> "FreeOfLaw":
        """Return the same at some lines."""
        left, slope = (each[..., lines] for each in (self.left, self.slope))
        return FreeOfLaw(left, slope, self.along.at_lines(lines, 1.0))

    def normal_equations(self) -> tuple[Points, Curvatures, OfPoints]:
        """Gradient and curvature along all else, the law following it, and the sum of squares."""
        gradient, curvature = self.along.products(self.left)  # this has no part along a law
        crossed = self.along.crossed(self.slope)
        share = over(crossed, np.sum(np.abs(self.slope) ** 2, axis=1)[:, None])
        curvature -= np.real(share @ np.conj(crossed).transpose(0, 2, 1))
        return gradient, curvature, 2 * half_squares(self.left)


class AnyLaw:
    """What a descent over all unknowns makes small, the law free at each line."""

    def __init__(self, free: Free):
        self.free = free

    def cost(self, points: Points) -> np.ndarray:
        """Minus log posterior density."""
        return np.concatenate([self._cost(part) for part in in_parts(points, self.free.problem)])

    def normal_equations(self, points: Points) -> NormalEquations:
        """Normal equations, the law left out at each line."""
        parts = [self._normal_equations(part) for part in in_parts(points, self.free.problem)]
        return NormalEquations(*map(np.concatenate, zip(*parts, strict=True)))

    def _cost(self, points: Points) -> np.ndarray:
        at = self.free.at(points)
        return half_squares(at.left(at.best())) + half_squares(points)

    def _normal_equations(self, points: Points) -> NormalEquations:
        gradient, curvature, squares = self.free_of_law(points).normal_equations()
        gradient += np.where(np.isin(np.arange(points.shape[1]), self.free.held), 0.0, points)
        cost = 0.5 * squares + half_squares(points)
        return NormalEquations(cost, gradient, curvature + np.eye(points.shape[1]), squares)

    def free_of_law(self, points: Points) -> "FreeOfLaw":
        """What is left at points once the law has done its best at each line."""
        at = self.free.at(points)
        strength = at.best()
        slopes = self.free.slopes(points, strength, 1 - at.receptance * strength)
        return FreeOfLaw(at.left(strength), at.slope, slopes)


def in_parts(points: Points, problem: Problem) -> list[Float[np.ndarray, "some unknown"]]:
    """Points in parts, so many that slopes at those of each can be kept together."""
    together = MOST_SLOPES // max(1, problem.squares.column_groups.number * problem.count)
    return np.array_split(points, max(1, -(-len(points) // max(1, together))))


def complex_residuals(
    residual: Float[np.ndarray, "*point datum"], problem: Problem
) -> Inexact[np.ndarray, "*point channel frequency"]:
    """Complex residuals [..., channel, frequency] from those of both parts; of amplitudes real.

    Those of earlier states follow as further channels, which no law changes: what matters are sums
    over all.
    """
    parts = by_line(residual, problem)
    if not tells_phase(problem):
        return parts[..., 0, :]
    values = np.empty((*parts.shape[:-2], parts.shape[-1]), complex)
    values.real, values.imag = parts[..., 0, :], parts[..., 1, :]  # nothing is copied twice
    return values


def tells_phase(problem: Problem) -> bool:
    """Whether complex FRFs were measured, so that residuals are linear in a free law."""
    return problem.experiment.observe.parts > 1


def half_squares(values: np.ndarray) -> np.ndarray:
    """Half the sum of squares of each point."""
    return 0.5 * np.sum(np.abs(values) ** 2, axis=tuple(range(1, values.ndim)))


def squares_by_line(residual: Channels) -> Float[np.ndarray, "point frequency"]:
    """Sums of squares over the channels at each line."""
    return np.sum(np.abs(residual) ** 2, axis=1)


def over(numerator: np.ndarray | float, denominator: np.ndarray) -> np.ndarray:
    """Quotient; zero where the denominator is, and where a port cannot move."""
    is_known = (denominator != 0) & np.isfinite(denominator) & np.isfinite(numerator)
    safe = np.where(is_known, denominator, 1.0)
    return np.where(is_known, np.where(is_known, numerator, 0.0) / safe, 0.0)
