"""Modes of a finite element model some of whose supports, regions or members change."""

import abc
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .changed import DerivedModes, changed, eigenpairs, original_nodal_modes, over_changed_modes
from .finite_elements.interpolation import Interpolation
from .finite_elements.nodal_modes import NodalModes
from .finite_elements.static_shapes import StaticShapes
from .modes import AxisShapes, Coordinates, Modes

Patterns = Float[Array, "axis static_shape"]
Square = Float[Array, "static_shape static_shape"]

# Of the greatest flexibility, below which a negative one counts as zero: combinations of static
# shapes that nearly depend on each other raise rounding a million times. A structure that has
# buckled has far more: its stiffness went through zero.
_ROUNDING = 1e-6


class ResidualShapes(eqx.Module):
    """Static shapes of unit relative displacements at interfaces, less their part in kept modes.

    These are constraint modes of supports and hinges, and attachment modes of other parts.
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


Compliances = Float[Array, "pattern pattern"]

Number: TypeAlias = int | Int[Array | np.ndarray, ""]
Matrix: TypeAlias = Float[Array, "rows columns"]

_DEPENDENT = 1e-6  # of a modal mass, below which a combination of shapes depends on others


class CompliantPart(NamedTuple):
    """A support on springs, or a joint with one."""

    support: Number
    """Number of the support, or with all of these before it, of the joint."""
    spring: Parameter
    """Compliance of its springs: [rad/(N m)] in a rotation, [m/N] in a translation, [m^2/N] along
    an edge."""

    def number(self, static_shapes: StaticShapes) -> Number:
        """Number of the support or joint among all flexible parts."""
        return self.support

    def compliance(self, nodal: NodalModes) -> Float[Array, ""]:
        """Compliance in unit patterns."""
        return jnp.asarray(self.spring, float)

    def stiffness(self, nodal: NodalModes) -> Matrix:
        """Raise, since the kept modes do not move at a support nor turn in a joint."""
        raise InputError(
            "A support or a joint was to become soft, but its static shapes are not known for "
            "these modes: they are those of one stiffness matrix, which only youngs_modulus and "
            "density may scale. Use finite_elements.modes(matrices, ..., soft={...})."
        )


class WeakenedRegion(NamedTuple):
    """A region that loses a share of its stiffness."""

    region: Number
    """Number of the region."""
    loss: Parameter
    """The share [1]."""

    def number(self, static_shapes: StaticShapes) -> Number:
        """Number of the region among all flexible parts."""
        return static_shapes.compliant_parts + jnp.asarray(self.region)

    def compliance(self, nodal: NodalModes) -> Float[Array, ""]:
        """Compliance in unit patterns."""
        return _compliance_of_loss(self.loss) / nodal.stiffness_scale()

    def stiffness(self, nodal: NodalModes) -> Matrix:
        """Stiffness [(rad/s)^2] that the loss adds over the modes."""
        region = nodal.regions.matrices[self.region]
        return -self.loss * region * nodal.stiffness_scale() / nodal.mass_scale()


class StretchedMember(NamedTuple):
    """A member under tension: a region of geometric stiffness that gains a share of it."""

    member: Number
    """Number of the member."""
    tension: Parameter
    """Tension [N]."""

    def number(self, static_shapes: StaticShapes) -> Number:
        """Number of the member among all flexible parts."""
        before = static_shapes.compliant_parts + len(static_shapes.regions)
        return before + jnp.asarray(self.member)

    def compliance(self, nodal: NodalModes) -> Float[Array, ""]:
        """Compliance in unit patterns."""
        tension = jnp.asarray(nodal.static_shapes.tension)[self.member] * nodal.stiffness_scale()
        return _compliance_of_loss(-self.tension / tension) / nodal.stiffness_scale()

    def stiffness(self, nodal: NodalModes) -> Matrix:
        """Stiffness [(rad/s)^2] that the tension adds over the modes."""
        member = nodal.members.matrices[self.member]
        return self.tension * member / nodal.mass_scale()


FlexiblePart: TypeAlias = CompliantPart | WeakenedRegion | StretchedMember


def _compliance_of_loss(loss: Parameter) -> Float[Array, ""]:
    """Compliance equivalent to the loss of a share q of a unit stiffness, q / (1 - q)."""
    share = jnp.asarray(loss, float)
    return share / (1 - share)


class _ResidualPatterns(ResidualShapes):
    """Static shapes of a finite element model, less their part in its modes."""

    interpolation: Interpolation
    shape: Float[Array, "row pattern"]

    def shapes(
        self, position: Coordinates, derivative: int, mode_shapes: AxisShapes
    ) -> Float[Array, "axis pattern"]:
        """Shapes of the patterns, less their part in the modes."""
        reading = self.interpolation.at(position)
        return reading.weight @ self.shape[reading.rows]


def with_flexible_parts(modes: Modes, parts: Sequence[FlexiblePart]) -> Modes:
    """Change parts of a finite element model, all at once.

    Where static shapes are not known, in the span of the kept modes, by the procedure of Ritz.
    """
    nodal = original_nodal_modes(modes)
    if modes is nodal and nodal.static_shapes.parts:
        return _compliant(nodal, parts)
    added = [over_changed_modes(modes, part.stiffness(nodal)) for part in parts]
    return changed(modes, jnp.sum(jnp.stack(added), axis=0))


def _compliant(nodal: NodalModes, parts: Sequence[FlexiblePart]) -> CompliantModes:
    known, stiffness, mass = nodal.static_shapes, nodal.stiffness_scale(), nodal.mass_scale()
    numbers = jnp.stack([jnp.asarray(part.number(known)) for part in parts])
    compliance = jnp.stack([part.compliance(nodal) for part in parts])
    chosen = known.select(known.patterns(numbers))
    orthonormal, participation, flexibility = _orthonormal(chosen, len(parts))
    of_elastic_modes = jnp.asarray(chosen.participation)[nodal.rigid_body_modes :]
    interface = Interface(
        participation=jnp.sqrt(mass) * of_elastic_modes,
        orthonormal=orthonormal / jnp.sqrt(mass),
        residual_participation=jnp.sqrt(mass) * participation,
        residual_flexibility=mass / stiffness * flexibility,
        compliance=_in_series(
            jnp.repeat(compliance, known.patterns_per_part),
            stiffness * jnp.asarray(chosen.reaction),
        ),
    )
    residual = _ResidualPatterns(nodal.interpolation, jnp.asarray(chosen.shape))
    return compliant_modes(nodal, residual, interface)


def _orthonormal(chosen: StaticShapes, parts: int) -> tuple[Matrix, Matrix, Matrix]:
    """Mass-orthonormal residual shapes: combinations, participation and flexibility."""
    orthonormal, participation, flexibility = map(
        jnp.asarray, (chosen.orthonormal, chosen.residual_participation, chosen.flexibility)
    )
    if parts == 1:
        return orthonormal, participation, flexibility
    # Residual shapes of different parts may nearly agree.
    values, vectors = jnp.linalg.eigh(jax.lax.stop_gradient(jnp.asarray(chosen.mass)))
    unit = jnp.where(values > _DEPENDENT, vectors / jnp.sqrt(jnp.abs(values)), 0.0)
    return orthonormal @ unit, unit.T @ participation, unit.T @ flexibility @ unit


def _in_series(compliance: Float[Array, "pattern"], reaction: Compliances) -> Compliances:
    """Compliances in series with the reactions of the structure, C (1 + S C)^-1."""
    springs = jnp.diag(compliance)
    in_series = jnp.linalg.solve(jnp.eye(compliance.size) + springs @ reaction, springs)
    return (in_series + in_series.T) / 2
