"""Laws fitted together with their place and all other unknowns: nothing is linearised.

Every network of one kind of port is fitted with one compiled response, since its law comes in as
numbers at the lines.
"""

import numpy as np
from jaxtyping import Complex, Float

from ..._shared.dimensions import Spectrum
from ...inference.engines.least_squares import STEP, NormalEquations
from ...laws.rows import NUMBERS, Which
from ._asked import Rows, closed, held_last
from ._free_law import Channels, Free, Lines, Points, half_squares, tells_phase
from ._slopes import Curvatures, Slopes

AlongNumbers = Complex[np.ndarray, "point number frequency"]
Numbers = Float[np.ndarray, "point number"]
OfNumbers = Float[np.ndarray, "point number number"]
Across = Float[np.ndarray, "point unknown number"]


class LawsInFull:
    """What a descent over the unknowns of the problem and the numbers of laws makes small.

    The coordinates of the problem come first, then those of a row, then the number of its network.

    `free` is the experiment with a port, or a factor on channels; `rows` are networks, or filters;
    `omega` are angular frequencies [rad/s]; `is_cut` says that laws are inserted.
    """

    def __init__(self, free: Free, rows: Rows, omega: Spectrum, is_cut: bool):
        self.free, self.rows, self.omega, self.is_cut = free, rows, omega, is_cut

    @property
    def largest(self) -> np.ndarray:
        """Largest coordinates."""
        return np.array([5.0] * (self.free.problem.dimension + NUMBERS) + [np.inf])

    def cost(self, points: Points) -> np.ndarray:
        """Minus log posterior density."""
        of_problem, of_law, which = self._parts(points)
        stiffness = self.rows.stiffness(which, of_law, self.omega)
        residual = self.free.residuals(of_problem, *self._law(stiffness))
        return half_squares(residual) + half_squares(of_problem) + half_squares(of_law)

    def normal_equations(self, points: Points) -> NormalEquations:
        """Normal equations."""
        of_problem, of_law, which = self._parts(points)
        stiffness, along = self.rows.at_lines(which, of_law, self.omega)
        of_others = self.free.slopes(of_problem, *self._law(stiffness))
        left, *of_numbers = self._along_numbers(of_problem, stiffness, along, of_others)
        gradient, curvature = _joined(of_others.products(left), *of_numbers)
        prior = points[:, :-1].copy()
        squares = 2 * half_squares(left)
        cost = 0.5 * squares + half_squares(prior)
        prior[:, self.free.held] = 0.0
        return held_last(NormalEquations(cost, gradient + prior, curvature, squares), 1)

    def _along_numbers(
        self, of_problem: Points, stiffness: Lines, along: AlongNumbers, others: Slopes
    ) -> tuple[Channels, Numbers, OfNumbers, Across]:
        """Residuals, and products of their slopes along the numbers of laws.

        With the residuals, with each other, and with slopes along all other unknowns; sums over
        channels are those of t. Of amplitudes slopes are differences.
        """
        if not tells_phase(self.free.problem):
            return self._by_differences(of_problem, stiffness, along, others)
        at = self.free.about(of_problem, stiffness)
        strength, softened = closed(stiffness, at.receptance, self.is_cut)
        left, along = at.left(strength), along * softened[:, None]
        conjugate = np.conj(along)
        pull = np.sum(np.conj(at.slope) * left, axis=1)
        pulls = np.real(conjugate @ pull[..., None])[..., 0]
        squares = np.real((along * at.information()[:, None]) @ conjugate.transpose(0, 2, 1))
        across = np.real(others.crossed(at.slope) @ conjugate.transpose(0, 2, 1))
        return left, pulls, squares, across

    def _by_differences(
        self, of_problem: Points, stiffness: Lines, along: AlongNumbers, others: Slopes
    ) -> tuple[Channels, Numbers, OfNumbers, Across]:
        left = self.free.residuals(of_problem, *self._law(stiffness))
        moved = [
            (self.free.residuals(of_problem, *self._law(stiffness + STEP * each)) - left) / STEP
            for each in along.swapaxes(0, 1)
        ]
        flat = np.stack(moved, axis=1).reshape(len(left), len(moved), -1)
        pulls = (flat @ left.reshape(len(left), -1, 1))[..., 0]
        across = [others.crossed(each).real.sum(axis=-1) for each in moved]
        return left, pulls, flat @ flat.transpose(0, 2, 1), np.stack(across, axis=-1)

    def _parts(self, points: np.ndarray) -> tuple[Points, Numbers, Which]:
        size = self.free.problem.dimension
        which = points[:, -1].astype(int)
        return points[:, :size], points[:, size:-1], which

    def _law(self, stiffness: Lines) -> tuple[Lines, Lines]:
        """Numerator and denominator at the lines."""
        ones = np.ones_like(stiffness)
        return (ones, stiffness) if self.is_cut else (stiffness, ones)


def _joined(
    of_others: tuple[Points, Curvatures], pulls: Numbers, squares: OfNumbers, across: Across
) -> tuple[np.ndarray, np.ndarray]:
    """Gradient and curvature along all other unknowns, then along the numbers of laws."""
    upper = np.concatenate([of_others[1], across], axis=2)
    lower = np.concatenate([across.transpose(0, 2, 1), squares], axis=2)
    gradient = np.concatenate([of_others[0], pulls], axis=1)
    return gradient, np.concatenate([upper, lower], axis=1)
