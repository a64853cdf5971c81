"""opened: in, modes and static shapes along which the structure gives way; out, the modes then.

Not known here: what gives way, and how softly; attachments, damping, data.
"""

import abc
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ._eigenpairs import eigenpairs
from .changed import Altered
from .modes import Modes

_ROUNDING = 1e-9  # of the greatest flexibility, below which a negative one counts as zero


class Lacking(eqx.Module):
    """What kept modes lack of the static shapes of unit openings, readable at any point."""

    @abc.abstractmethod
    def shapes(
        self,
        position: Float[Array, "*coordinate"],
        derivative: int,
        kept: Float[Array, "axis mode"],
    ) -> Float[Array, "axis opening"]:
        """Shapes or their derivatives at a position, given those of the modes there."""


class Opening(NamedTuple):
    """Openings of a structure, seen from its modes.

    Parameters
    ----------
    participation
        Mass products of the elastic modes with the static shapes of unit openings.
    orthonormal
        Combinations of what the modes lack of them that are mass-orthonormal.
    share
        Mass products of these with the static shapes.
    beyond
        Flexibility of these [s^2].
    in_series
        Compliances of the openings, in series with what holds them.
    """

    participation: Float[Array, "elastic opening"]
    orthonormal: Float[Array, "opening opening"]
    share: Float[Array, "opening opening"]
    beyond: Float[Array, "opening opening"]
    in_series: Float[Array, "opening opening"]


class OpenedModes(Altered):
    """Modes of a structure that gives way somewhere; made by `opened`."""

    modes: Modes
    lacking: Lacking
    squares: Float[Array, "mode"]
    of_modes: Float[Array, "mode mode"]
    of_lacking: Float[Array, "opening mode"]
    participation: Float[Array, "mode opening"]
    in_series: Float[Array, "opening opening"]
    remaining: Float[Array, "mode mode"] | None
    axes: tuple[int, ...] = eqx.field(static=True)
    rigid_body_modes: int = eqx.field(static=True)

    def shapes(
        self, position: Float[Array, "*coordinate"], derivative: int = 0
    ) -> Float[Array, "axis mode"]:
        """Mass-normalised mode shapes [kg^-1/2] and their derivatives."""
        kept, lacking = self._parts(position, derivative)
        return kept @ self.of_modes + lacking @ self.of_lacking

    def static_flexibility(
        self, position: Float[Array, "*coordinate"], other: Float[Array, "*coordinate"]
    ) -> Float[Array, "axis axis"] | None:
        """Static flexibility [m/N] of all elastic modes, openings included."""
        before = self.modes.static_flexibility(position, other)
        if before is None:
            return None
        here, there = self._static_shapes(position), self._static_shapes(other)
        return before + here @ self.in_series @ there.T

    def _parts(self, position: Float[Array, "*coordinate"], derivative: int) -> tuple[Array, Array]:
        kept = self.modes.shapes(position, derivative)
        return kept, self.lacking.shapes(position, derivative, kept)

    def _static_shapes(self, position: Float[Array, "*coordinate"]) -> Float[Array, "axis opening"]:
        kept, lacking = self._parts(position, 0)
        return lacking + kept @ self.participation


def opened(modes: Modes, lacking: Lacking, opening: Opening) -> OpenedModes:
    """Modes of a structure that gives way.

    Its flexibility grows by psi C' psi^T, where psi are the static shapes of unit openings and C'
    the compliances in series with what holds them. The eigenvalues in the span of the kept modes
    and psi are 1 / omega_n^2: a Ritz procedure in flexibility, in which a compliance of zero
    changes nothing, bit for bit. As many modes are kept as before; what they lack is in the
    static flexibility, which is exact.
    """
    rigid = modes.rigid_body_modes
    squares = modes.angular_frequency() ** 2
    over_squares = 1 / squares[rigid:]
    jumps = jnp.concatenate([opening.participation, opening.share])
    before = jax.scipy.linalg.block_diag(_flexibility(modes, over_squares), opening.beyond)
    values, vectors, coupling = eigenpairs(-(before + jumps @ opening.in_series @ jumps.T))
    kept = over_squares.size  # eigenvalues ascend: the lowest mode comes first
    # At zero compliance the eigenvalues are those put in, so the difference is zero, exactly.
    growth = (over_squares + values[:kept]) / over_squares
    found = jnp.concatenate([squares[:rigid], squares[rigid:] * (1 + growth / (1 - growth))])
    # A negative flexibility comes last: the structure has buckled.
    found = jnp.where(values[-1] > _ROUNDING * -values[0], jnp.nan, found)
    of_lacking = opening.orthonormal @ vectors[kept:, :kept]
    remaining = found[:, None] * jnp.pad(coupling[:kept, :kept], ((rigid, 0), (rigid, 0))) * found
    return OpenedModes(
        modes=modes,
        lacking=lacking,
        squares=found,
        of_modes=jax.scipy.linalg.block_diag(jnp.eye(rigid), vectors[:kept, :kept]),
        of_lacking=jnp.pad(of_lacking, ((0, 0), (rigid, 0))),
        participation=jnp.pad(opening.participation, ((rigid, 0), (0, 0))),
        in_series=opening.in_series,
        remaining=remaining,
        axes=modes.axes,
        rigid_body_modes=rigid,
    )


def _flexibility(
    modes: Modes, over_squares: Float[Array, "elastic"]
) -> Float[Array, "elastic elastic"]:
    """Flexibility [s^2] over the elastic modes: diagonal, but for what changes have left."""
    still, rigid = modes.coupling(), modes.rigid_body_modes
    if still is None:
        return jnp.diag(over_squares)
    return jnp.diag(over_squares) - over_squares[:, None] * still[rigid:, rigid:] * over_squares
