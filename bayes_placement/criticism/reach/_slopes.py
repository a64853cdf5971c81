"""Slopes of complex residuals, of which most are zero: a sensor moves its own channels alone."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from jaxtyping import Bool, Complex, Float, Inexact, Int

from ...inference.engines._column_groups import ColumnGroups
from ...inference.residuals import Problem

Curvatures = Float[np.ndarray, "point unknown unknown"]
SomeLines: TypeAlias = slice | Int[np.ndarray, "line"]
Channels = Inexact[np.ndarray, "point channel frequency"]
"""A complex number at each line of each channel; of amplitudes a real one."""

Along: TypeAlias = Inexact[np.ndarray, "point group channel frequency"]
"""Slopes along unknowns that are changed together."""


@dataclass(frozen=True, eq=False)
class Sparsity:
    """Which residuals each unknown changes.

    Unknowns of one group change different residuals. `changes` are parts of the residuals that each
    changes, real and imaginary; those of an earlier state may be of different sensors.
    """

    group: Int[np.ndarray, "unknown"]
    changes: Bool[np.ndarray, "unknown channel frequency part"]

    @classmethod
    def of(cls, problem: Problem, held: Sequence[int] = ()) -> "Sparsity":
        """Read it of a problem, some of whose unknowns are held."""
        groups = problem.squares.column_groups
        changes = np.moveaxis(by_line(groups.changes, problem), -2, -1).copy()
        changes[list(held)] = False
        return cls(groups.group, changes)

    def at_lines(self, lines: SomeLines) -> "Sparsity":
        """Return the same at some lines."""
        return Sparsity(self.group, self.changes[:, :, lines])

    @functools.cached_property
    def columns(self) -> ColumnGroups:
        """The same of the numbers of all residuals."""
        return ColumnGroups(self.group, self.changes.reshape(len(self.group), -1))

    @functools.cached_property
    def of_channels(self) -> list[Int[np.ndarray, "some"]]:
        """Unknowns that change a residual of each channel."""
        changed = np.any(self.changes, axis=(2, 3))
        return [np.flatnonzero(of_channel) for of_channel in np.transpose(changed)]


@dataclass(frozen=True, eq=False)
class Slopes:
    """Slopes of complex residuals at points, along the groups of unknowns."""

    along: Along
    sparsity: Sparsity

    def at_lines(self, lines: SomeLines, weight: float) -> "Slopes":
        """Return those at some lines, each of a weight."""
        return Slopes(weight * self.along[..., lines], self.sparsity.at_lines(lines))

    def products(self, residual: Channels) -> tuple[Float[np.ndarray, "point unknown"], Curvatures]:
        """Products with residuals, and with each other."""
        squares, pulls = self.sparsity.columns.products(_numbers(self.along, 2), _numbers(residual))
        return pulls, squares

    def crossed(self, slope: Channels) -> Complex[np.ndarray, "point unknown frequency"]:
        """Sum over channels of their products with another slope, line by line.

        That of a law, which changes nothing in an earlier state.
        """
        of = self.sparsity
        products = np.conj(slope)[:, None] * self.along
        crossed = np.zeros((len(slope), len(of.group), slope.shape[-1]), complex)
        for channel, unknowns in enumerate(of.of_channels):
            crossed[:, unknowns] += products[:, of.group[unknowns], channel] * of.changes[
                unknowns, channel
            ].any(-1)
        return crossed


def by_line(values: np.ndarray, problem: Problem) -> np.ndarray:
    """Values [..., channel, part, frequency] of residuals, those of earlier states as channels.

    Zeros fill up the last one where these have other lines.
    """
    count, lines = problem.experiment.observe.parts, problem.data.z.shape[-1]
    missing = -values.shape[-1] % (count * lines)
    if missing:
        values = np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, missing)])
    return values.reshape(*values.shape[:-1], -1, count, lines)


def measured_by_line(problem: Problem) -> Int[np.ndarray, "line"]:
    """Return how many numbers were measured at each line."""
    measured = np.asarray(problem.data.measured)
    return measured.reshape(-1, measured.shape[-1]).sum(axis=0)


def _numbers(values: np.ndarray, axes: int = 1) -> Float[np.ndarray, "*point number"]:
    """Real and imaginary parts of all channels and lines in one axis."""
    whole = np.ascontiguousarray(values)
    return whole.reshape(*values.shape[:axes], -1).view(float)
