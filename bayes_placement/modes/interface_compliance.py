"""Modes of a structure that has become compliant at interfaces: hinges, supports, regions."""

import abc
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .changed import DerivedModes
from .eigenpairs import eigenpairs
from .modes import AxisShapes, Coordinates, Modes

Patterns = Float[Array, "axis static_shape"]
Square = Float[Array, "static_shape static_shape"]

# Of the greatest flexibility, below which a negative one counts as zero: combinations of static
# shapes that nearly depend on each other raise rounding a million times. A structure that has
# buckled has far more: its stiffness went through zero.
_ROUNDING = 1e-6


class ResidualShapes(eqx.Module):
    """Static shapes of unit relative displacements at interfaces, less their part in kept modes.

    These are constraint modes of supports and hinges, and attachment modes of regions and members.
    """

    @abc.abstractmethod
    def shapes(self, position: Coordinates, derivative: int, mode_shapes: AxisShapes) -> Patterns:
        """Shapes or their derivatives at a position [m].

        Those of the kept modes there, or their derivatives, are given.
        """


class Interface(NamedTuple):
    """Interfaces whose two sides may move relative to each other, in terms of the modes."""

    participation: Float[Array, "elastic static_shape"]
    """Mass products of the elastic modes with the static shapes of unit relative displacements."""
    orthonormal: Square
    """Combinations of the residual shapes that are mass-orthonormal."""
    residual_participation: Square
    """Mass products of these with the static shapes."""
    residual_flexibility: Square
    """Flexibility of these [s^2]."""
    compliance: Square
    """Compliances of the interfaces, in series with the structure that resists the relative
    displacements."""


class CompliantModes(DerivedModes):
    """Modes of a structure with compliant interfaces; made by `compliant_modes`."""

    modes: Modes
    residual: ResidualShapes
    eigenvalues: Float[Array, "mode"]
    of_modes: Float[Array, "mode mode"]
    of_residual: Float[Array, "static_shape mode"]
    participation: Float[Array, "mode static_shape"]
    added_flexibility: Square
    repeated_coupling: Float[Array, "mode mode"] | None
    axes: tuple[int, ...] = eqx.field(static=True)
    rigid_body_modes: int = eqx.field(static=True)

    def shapes(self, position: Coordinates, derivative: int = 0) -> AxisShapes:
        """Mass-normalised mode shapes [kg^-1/2] and their derivatives."""
        mode_shapes, residual = self._parts(position, derivative)
        return mode_shapes @ self.of_modes + residual @ self.of_residual

    def flexible_shapes(self, position: Coordinates, derivative: int) -> Patterns:
        """Static shapes of unit relative displacements, or their derivatives."""
        mode_shapes, residual = self._parts(position, derivative)
        return residual + mode_shapes @ self.participation

    def _parts(self, position: Coordinates, derivative: int) -> tuple[Array, Array]:
        mode_shapes = self.modes.shapes(position, derivative)
        return mode_shapes, self.residual.shapes(position, derivative, mode_shapes)


def compliant_modes(modes: Modes, residual: ResidualShapes, interface: Interface) -> CompliantModes:
    """Modes of a structure once its interfaces are compliant.

    Its flexibility grows by psi C' psi^T, where psi are the static shapes of unit relative
    displacements and C' the compliances in series with the structure. The eigenvalues in the span
    of the kept modes and psi are 1 / omega_n^2: a Ritz procedure in flexibility, in which a
    compliance of zero changes nothing, bit for bit. As many modes are kept as before; the static
    flexibility is exact and contains the others.
    """
    rigid = modes.rigid_body_modes
    before = modes.angular_frequency() ** 2
    flexibility = 1 / before[rigid:]
    participation = jnp.concatenate([interface.participation, interface.residual_participation])
    unchanged = jax.scipy.linalg.block_diag(
        _flexibility(modes, flexibility), interface.residual_flexibility
    )
    values, vectors, coupling = eigenpairs(
        -(unchanged + participation @ interface.compliance @ participation.T)
    )
    mode_count = flexibility.size  # eigenvalues ascend: the lowest mode comes first
    # At zero compliance the eigenvalues are those put in, so the difference is exactly zero.
    growth = (flexibility + values[:mode_count]) / flexibility
    eigenvalues = jnp.concatenate([before[:rigid], before[rigid:] * (1 + growth / (1 - growth))])
    # A negative flexibility comes last: the structure has buckled.
    eigenvalues = jnp.where(values[-1] > _ROUNDING * -values[0], jnp.nan, eigenvalues)
    of_residual = interface.orthonormal @ vectors[mode_count:, :mode_count]
    padded_coupling = jnp.pad(coupling[:mode_count, :mode_count], ((rigid, 0), (rigid, 0)))
    return CompliantModes(
        modes=modes,
        residual=residual,
        eigenvalues=eigenvalues,
        of_modes=jax.scipy.linalg.block_diag(jnp.eye(rigid), vectors[:mode_count, :mode_count]),
        of_residual=jnp.pad(of_residual, ((0, 0), (rigid, 0))),
        participation=jnp.pad(interface.participation, ((rigid, 0), (0, 0))),
        added_flexibility=interface.compliance,
        repeated_coupling=eigenvalues[:, None] * padded_coupling * eigenvalues,
        axes=modes.axes,
        rigid_body_modes=rigid,
    )


def _flexibility(
    modes: Modes, diagonal: Float[Array, "elastic"]
) -> Float[Array, "elastic elastic"]:
    """Flexibility [s^2] over the elastic modes: diagonal, but for repeated eigenvalues."""
    coupling, rigid = modes.coupling(), modes.rigid_body_modes
    if coupling is None:
        return jnp.diag(diagonal)
    return jnp.diag(diagonal) - diagonal[:, None] * coupling[rigid:, rigid:] * diagonal
