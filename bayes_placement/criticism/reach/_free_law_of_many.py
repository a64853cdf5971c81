"""A law that is free at each line where it acts at many places at once: on a region, or everywhere.

There residuals r(Z) are no longer linear in one number. To second order about any law they are,
r + a t with t = Z / (1 + h Z), of which h follows from a step of Z and from two. From no law on,
Newton's steps to the Z of least squares lead to that of least residuals at each line. Points come
in, what a law does there goes out; on what it acts is not known here.
"""

import numpy as np
from jaxtyping import Bool

from ._free_law import AtPort, FreeLaw, Lines, Points, complex_residuals, over, squares_by_line

ROUNDS = 2
"""Steps from no law, of which each doubles the digits in the end."""

STEPS = 2
"""Steps of descents over all else: each takes many responses, and laws are fitted in full later."""


class FreeLawOfMany(FreeLaw):
    """What `FreeLaw` is of one port, of a law on all of a region, or in the modulus everywhere."""

    def at(self, points: Points) -> AtPort:
        """What a law does about the one that leaves least at each line."""
        stiffness = np.zeros((len(points), self._lines), complex)
        at = self.about(points, stiffness)
        least, proposed = squares_by_line(at.free), newton(at)
        for _ in range(ROUNDS):
            there = self.about(points, proposed)
            strength = over(proposed, 1 + there.receptance * proposed)
            left = squares_by_line(there.left(strength))
            is_less = left < least
            stiffness = np.where(is_less, proposed, stiffness)
            least = np.where(is_less, left, least)
            at = _chosen(is_less, there, at)
            proposed = np.where(is_less, newton(at), (stiffness + proposed) / 2)
        return at

    def about(self, points: Points, stiffness: Lines) -> AtPort:
        """What laws do about one of them."""
        return self._about(points, stiffness, self._soft)

    def released(self) -> "FreeLawOfMany":
        """Return the same with nothing held."""
        return FreeLawOfMany(self.problem)

    def _read_with(self, points: Points, soft: float) -> AtPort:
        return self._about(points, np.zeros((len(points), self._lines), complex), soft)

    def _about(self, points: Points, stiffness: Lines, soft: float) -> AtPort:
        """Residuals to second order about a law, as if it acted at one port."""
        laws = np.stack([stiffness + step * soft for step in range(3)], axis=1)
        pairs = np.stack([laws, np.ones_like(laws)], axis=2)
        residual = complex_residuals(self.problem.with_laws(points, pairs), self.problem)
        by_one, by_two = residual[:, 1] - residual[:, 0], residual[:, 2] - residual[:, 0]
        # Changes are a s / (1 + h s) and 2 a s / (1 + 2 h s) with the step s.
        further = np.sum(np.abs(by_two - by_one) ** 2, axis=1)
        bent = np.sum(np.conj(by_two - by_one) * (by_one - by_two / 2), axis=1)
        local = over(bent, further * soft)
        softened = 1 - local * stiffness
        slope = by_one * (1 / soft + local)[:, None]
        return AtPort(
            residual[:, 0] - slope * over(stiffness, softened)[:, None],
            slope * over(1.0, softened**2)[:, None],
            over(local, softened),
        )


def newton(at: AtPort) -> Lines:
    """Law of least squares at each line, of residuals that are linear in one number."""
    strength = at.best()
    return over(strength, 1 - at.receptance * strength)


def _chosen(lines: Bool[np.ndarray, "point frequency"], one: AtPort, other: AtPort) -> AtPort:
    """One at some lines, the other at all others."""
    channels = lines[:, None]
    return AtPort(
        np.where(channels, one.free, other.free),
        np.where(channels, one.slope, other.slope),
        np.where(lines, one.receptance, other.receptance),
    )
