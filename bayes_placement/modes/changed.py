"""Modes of a structure to whose stiffness or mass something is added, and the original ones.

Derivatives are exact also where eigenvalues are repeated. Eigenvectors of these have no derivative,
but a receptance, made of all of them, has one. `Eigenpairs.coupling` and `with_coupling` keep the
part that no eigenvector can have.
"""

import abc
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float, Inexact
from numpyro.distributions import Distribution

from .._shared.errors import InputError
from ..positions.bounds import Bounds
from ..positions.places import Straight
from .beams import UniformBeam
from .beams.waveguide import Waveguide
from .finite_elements.nodal_modes import NodalModes, UnknownModes, nodal_of
from .modes import AxisShapes, Coordinates, Flexibility, Modes, Orders

_CLOSE = 1e-6  # of the greater eigenvalue of a pair, below which it counts as repeated
_ROUNDING = 1e-12  # of the greatest eigenvalue, below which one counts as zero

ModalResponse = Inexact[Array, "response mode frequency"]
ModalReference = Inexact[Array, "reference mode frequency"]
Receptance = Complex[Array, "response reference frequency"]
Modal = Float[Array, "mode mode"]


class Eigenpairs(NamedTuple):
    """Eigenpairs in ascending order, and what still couples those that coincide."""

    values: Float[Array, "mode"]
    """Eigenvalues."""
    vectors: Modal
    """Eigenvectors as columns."""
    coupling: Modal
    """The matrix between eigenvectors of one repeated eigenvalue, off its diagonal. It is zero, but
    its derivative is not: it is what the derivatives of the vectors leave out."""


@jax.custom_jvp
def eigenpairs(matrix: Modal) -> Eigenpairs:
    """Eigenpairs whose first derivatives are finite and exact, by perturbation.

    Nelson, AIAA Journal 14 (1976) 1201, DOI 10.2514/3.7211, for vectors of distinct eigenvalues.
    Derivatives of second order are exact where no eigenvalue is repeated.
    """
    values, vectors = jnp.linalg.eigh(matrix)
    # Of the two signs the one that makes the largest component positive: what is added to a shape
    # must keep its meaning while parameters change.
    largest = jnp.argmax(jnp.abs(vectors), axis=0)
    signs = jnp.sign(jnp.take_along_axis(vectors, largest[None], axis=0))
    return Eigenpairs(values, vectors * signs, jnp.zeros(matrix.shape))


@eigenpairs.defjvp
def _changes(primals: tuple[Modal], tangents: tuple[Modal]) -> tuple[Eigenpairs, Eigenpairs]:
    pairs = eigenpairs(*primals)
    values, vectors, _ = pairs
    change = vectors.T @ tangents[0] @ vectors
    gap = values[None, :] - values[:, None]
    size = jnp.maximum(jnp.abs(values[None, :]), jnp.abs(values[:, None]))
    close = jnp.abs(gap) <= _CLOSE * size + _ROUNDING * jnp.max(jnp.abs(values))
    rotation = jnp.where(close, 0.0, change / jnp.where(close, 1.0, gap))
    repeated = close & ~jnp.eye(values.size, dtype=bool)
    coupling = jnp.where(repeated, change, 0.0)
    return pairs, Eigenpairs(jnp.diagonal(change), vectors @ rotation, coupling)


@jax.custom_jvp
def with_coupling(
    receptance: Receptance, coupling: Modal, response: ModalResponse, reference: ModalReference
) -> Receptance:
    """Receptance with the first-order change by a coupling of modes whose value is zero.

    The coupling is a stiffness [(rad/s)^2] between modes of one frequency; response and reference
    are modal receptances times the shapes at the points of each. The receptance stays the same, but
    its derivative has - response d(coupling) reference besides.
    """
    return receptance


@with_coupling.defjvp
def _with_coupling_jvp(
    primals: tuple[Array, ...], tangents: tuple[Array, ...]
) -> tuple[Receptance, Receptance]:
    receptance, _, response, reference = primals
    change = -jnp.einsum("pnf,nm,qmf->pqf", response, tangents[1], reference)
    return receptance, tangents[0] + change


Mixed = Float[Array, "mixed mixed"]


class DerivedModes(Modes):
    """Modes derived from those of the structure before it was changed."""

    modes: eqx.AbstractVar[Modes]
    """The modes before."""
    of_modes: eqx.AbstractVar[Modal]
    """Combinations of them."""
    eigenvalues: eqx.AbstractVar[Float[Array, "mode"]]
    """Squares of the natural angular frequencies [(rad/s)^2]."""
    added_flexibility: eqx.AbstractVar[Float[Array, "flexible flexible"]]
    """Flexibility [m/N] over `flexible_shapes`, besides that of the modes before."""
    repeated_coupling: eqx.AbstractVar[Modal | None]
    """Stiffness between modes of one frequency; None where its derivative is zero."""

    @abc.abstractmethod
    def flexible_shapes(
        self, position: Coordinates, derivative: int
    ) -> Float[Array, "axis flexible"]:
        """Shapes that add to the static flexibility, or their derivatives."""

    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies [rad/s]."""
        return safe_root(self.eigenvalues)

    def static_flexibility(
        self, position: Coordinates, other: Coordinates, orders: Orders = (0, 0)
    ) -> Flexibility:
        """Static flexibility [m/N] of all elastic modes, and of what became flexible."""
        further = () if orders == (0, 0) else (orders,)  # which not all modes know
        before = self.modes.static_flexibility(position, other, *further)
        if before is None:
            return None
        response = self.flexible_shapes(position, orders[0])
        return before + response @ self.added_flexibility @ self.flexible_shapes(other, orders[1]).T

    def coupling(self) -> Modal | None:
        """Stiffness [(rad/s)^2] between modes of one frequency: zero, with a derivative.

        The static flexibility leaves it out, as what is subtracted of the kept modes does.
        """
        return self.repeated_coupling

    def bounds(self) -> Bounds:
        """Return the least and the greatest position on the structure [m]."""
        return self.modes.bounds()

    def anywhere(self) -> list[Distribution | Straight]:
        """Return the uniform distribution of a position on each piece of the structure [m]."""
        return self.modes.anywhere()


class ChangedModes(DerivedModes):
    """Combinations of other modes; made by `changed`. Modes left out stay as they were."""

    modes: Modes
    eigenvalues: Float[Array, "mode"]
    of_modes: Modal
    bending: Modal
    added_flexibility: Modal
    repeated_coupling: Modal
    axes: tuple[int, ...] = eqx.field(static=True)
    rigid_body_modes: int = eqx.field(static=True)

    def shapes(self, position: Coordinates, derivative: int = 0) -> AxisShapes:
        """Mass-normalised mode shapes [kg^-1/2] and their derivatives."""
        return self.modes.shapes(position, derivative) @ self.of_modes

    def flexible_shapes(self, position: Coordinates, derivative: int) -> AxisShapes:
        """Shapes of the modes before, or their derivatives."""
        return self.modes.shapes(position, derivative)


def changed(
    modes: Modes, stiffness: Mixed, mass: Mixed | None = None, bending: Modal | None = None
) -> ChangedModes:
    """Modes once modal stiffness [(rad/s)^2] and modal mass [1] are added.

    The Ritz procedure in the span of the kept modes, or of the lowest of them: matrices over fewer
    modes leave those above as they are. With nothing added the matrices are diagonal, for which the
    eigensolver returns them and the identity, bit for bit. By default all of a motion is bending.
    """
    before = modes.angular_frequency() ** 2
    coupling = modes.coupling()
    coupled = jnp.zeros((before.size, before.size)) if coupling is None else coupling
    mixed, count = slice(0, len(stiffness)), before.size - len(stiffness)
    lowest = _ritz(jnp.diag(before)[mixed, mixed] + stiffness + coupled[mixed, mixed], mass)
    eigenvalues = jnp.concatenate([lowest.values, before[len(stiffness) :]])
    combination = jax.scipy.linalg.block_diag(lowest.vectors, jnp.eye(count))
    rigid = modes.rigid_body_modes
    elastic = combination[:, rigid:]
    flexible = elastic / eigenvalues[rigid:]
    diagonal = jnp.concatenate([jnp.zeros(rigid), 1 / before[rigid:]])
    return ChangedModes(
        modes=modes,
        eigenvalues=eigenvalues,
        of_modes=combination,
        bending=combination if bending is None else bending @ combination,
        added_flexibility=flexible @ elastic.T - jnp.diag(diagonal),
        repeated_coupling=coupled.at[mixed, mixed].set(lowest.coupling),
        axes=modes.axes,
        rigid_body_modes=rigid,
    )


def _ritz(stiffness: Modal, mass: Modal | None) -> Eigenpairs:
    """Eigenpairs of a stiffness, and of a mass that is added to the identity."""
    if mass is None:
        return eigenpairs(stiffness)
    factor = jnp.linalg.cholesky(jnp.eye(len(mass)) + mass)
    half_reduced = jax.scipy.linalg.solve_triangular(factor, stiffness, lower=True)
    reduced = eigenpairs(jax.scipy.linalg.solve_triangular(factor, half_reduced.T, lower=True))
    vectors = jax.scipy.linalg.solve_triangular(factor.T, reduced.vectors, lower=False)
    return reduced._replace(vectors=vectors)


def over_changed_modes(modes: Modes, matrix: Modal) -> Modal:
    """Transform a matrix over the original modes to one over the changed modes."""
    if isinstance(modes, DerivedModes):
        before = over_changed_modes(modes.modes, matrix)
        return modes.of_modes.T @ before @ modes.of_modes
    if isinstance(modes, UnknownModes):
        scale = 1 / jnp.sqrt(modes.masses())
        return scale[:, None] * matrix * scale
    return matrix


def bending_shapes(modes: Modes, position: Coordinates, derivative: int) -> Float[Array, "mode"]:
    """Derivative of the part of each mode that causes internal forces: without shear."""
    if isinstance(modes, ChangedModes):
        return bending_shapes(modes.modes, position, derivative) @ modes.bending
    return modes.shapes(position, derivative)[0]


def safe_root(value: Float[Array, "mode"]) -> Float[Array, "mode"]:
    """Root with a finite gradient at the zeros of rigid-body modes; not a number if negative."""
    zero = jnp.abs(value) < _ROUNDING * jnp.max(value)
    return jnp.where(zero, 0.0, jnp.sqrt(jnp.where(zero, 1.0, value)))


def original(modes: Modes) -> Modes:
    """Return the modes before all changes."""
    return original(modes.modes) if isinstance(modes, DerivedModes) else modes


def original_waveguide(modes: Modes) -> Waveguide:
    """Return the uniform bar or beam beneath changed modes."""
    waveguide = original(modes)
    if isinstance(waveguide, Waveguide):
        return waveguide
    raise InputError(
        f"This effect was added to {type(waveguide).__name__}, but it needs to know the section of "
        "a uniform bar or beam, which those modes do not tell. Use beams.bar or beams.beam."
    )


def original_nodal_modes(modes: Modes) -> NodalModes:
    """Return the modes of the finite element model beneath changed ones."""
    nodal = nodal_of(original(modes))
    if nodal is not None:
        return nodal
    raise InputError(
        f"This effect was added to {type(original(modes)).__name__}, but it needs the matrices of "
        "a finite element model. Use finite_elements.modes(matrices, ...)."
    )


def required_waveguide(modes: Modes, effect: str, alternative: str) -> Waveguide:
    """Return the waveguide that an effect needs; an FE model takes an alternative to it."""
    if nodal_of(modes) is not None:
        raise InputError(
            f"{effect} was added to a finite element model, but it needs the section of a uniform "
            f"bar or beam, which a model does not tell. {alternative}"
        )
    return original_waveguide(modes)


def required_beam(modes: Modes, effect: str, reason: str, alternative: str) -> UniformBeam:
    """Return the beam that an effect needs; the reason says what a bar lacks."""
    waveguide = required_waveguide(modes, effect, alternative)
    if not isinstance(waveguide, UniformBeam):
        raise InputError(f"{effect} was added to a bar, {reason}. Use it on beams.beam.")
    return waveguide
