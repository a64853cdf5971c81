"""changed: in, modes and what is added to their stiffness and mass; out, the modes then.

Not known here: what was added, attachments, damping, data.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._types import InputError
from ..positions.bounds import Bounds
from ._eigenpairs import eigenpairs
from .beams.uniform_line import UniformLine
from .finite_elements.nodal_modes import NodalModes, UnknownModes, nodal_of
from .modes import Modes

_ROUNDING = 1e-12  # of the greatest squared frequency, below which one counts as zero


class Altered(Modes):
    """Modes that are made of those of a structure before something about it was altered."""

    modes: eqx.AbstractVar[Modes]
    squares: eqx.AbstractVar[Float[Array, "mode"]]
    remaining: eqx.AbstractVar[Float[Array, "mode mode"] | None]

    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies [rad/s]."""
        return safe_root(self.squares)

    def coupling(self) -> Float[Array, "mode mode"] | None:
        """Stiffness [(rad/s)^2] between modes of one frequency: zero, with a derivative.

        The static flexibility leaves it out, as what is subtracted of the kept modes does.
        """
        return self.remaining

    def bounds(self) -> Bounds:
        """Return the least and the greatest position on the structure [m]."""
        return self.modes.bounds()

    def anywhere(self) -> list[Any]:
        """Return the pieces of the structure, each as the uniform law of a place on it [m]."""
        return self.modes.anywhere()


class ChangedModes(Altered):
    """Combinations of other modes; made by `changed`. What is left out stays as it was."""

    modes: Modes
    squares: Float[Array, "mode"]
    mixture: Float[Array, "mode mode"]
    bending: Float[Array, "mode mode"]
    flexibility: Float[Array, "mode mode"]
    remaining: Float[Array, "mode mode"]
    axes: tuple[int, ...] = eqx.field(static=True)
    rigid_body_modes: int = eqx.field(static=True)

    def shapes(
        self, position: Float[Array, "*coordinate"], derivative: int = 0
    ) -> Float[Array, "axis mode"]:
        """Mass-normalised mode shapes [kg^-1/2] and their derivatives."""
        return self.modes.shapes(position, derivative) @ self.mixture

    def static_flexibility(
        self, position: Float[Array, "*coordinate"], other: Float[Array, "*coordinate"]
    ) -> Float[Array, "axis axis"] | None:
        """Static flexibility [m/N] of all elastic modes."""
        before = self.modes.static_flexibility(position, other)
        if before is None:
            return None
        here, there = self.modes.shapes(position), self.modes.shapes(other)
        return before + here @ self.flexibility @ there.T


def changed(
    modes: Modes,
    stiffness: Float[Array, "mode mode"],
    mass: Float[Array, "mode mode"] | None = None,
    bent: Float[Array, "mode mode"] | None = None,
) -> ChangedModes:
    """Modes once modal stiffness [(rad/s)^2] and modal mass [1] are added.

    The Ritz procedure in the span of the kept modes. With nothing added the matrices are diagonal,
    for which the eigensolver returns them and the identity, bit for bit.

    Parameters
    ----------
    modes
        The modes before.
    stiffness, mass
        What is added to the modal matrices.
    bent
        Which part of a motion is bending, over the modes before; all of it by default.
    """
    squares = modes.angular_frequency() ** 2
    total = jnp.diag(squares) + stiffness + _still(modes)
    if mass is None:
        values, mixture, remaining = eigenpairs(total)
    else:
        factor = jnp.linalg.cholesky(jnp.eye(squares.size) + mass)
        left = jax.scipy.linalg.solve_triangular(factor, total, lower=True)
        whole = jax.scipy.linalg.solve_triangular(factor, left.T, lower=True)
        values, vectors, remaining = eigenpairs(whole)
        mixture = jax.scipy.linalg.solve_triangular(factor.T, vectors, lower=False)
    rigid = modes.rigid_body_modes
    elastic, before = mixture[:, rigid:], jnp.concatenate([jnp.zeros(rigid), 1 / squares[rigid:]])
    flexible = elastic / values[rigid:]
    flexibility = flexible @ elastic.T - jnp.diag(before)
    bending = mixture if bent is None else bent @ mixture
    return ChangedModes(
        modes=modes,
        squares=values,
        mixture=mixture,
        bending=bending,
        flexibility=flexibility,
        remaining=remaining,
        axes=modes.axes,
        rigid_body_modes=rigid,
    )


def mixed(modes: Modes, matrix: Float[Array, "mode mode"]) -> Float[Array, "mode mode"]:
    """Return a matrix over the modes as drawn or handed over, over changed modes instead."""
    if isinstance(modes, ChangedModes):
        inner = mixed(modes.modes, matrix)
        return modes.mixture.T @ inner @ modes.mixture
    if isinstance(modes, UnknownModes):
        scale = 1 / jnp.sqrt(modes.masses())
        return scale[:, None] * matrix * scale
    return matrix


def _still(modes: Modes) -> Float[Array, "mode mode"] | float:
    """What earlier changes have left between modes of one frequency."""
    coupling = modes.coupling()
    return 0.0 if coupling is None else coupling


def bent_shapes(
    modes: Modes, position: Float[Array, "*coordinate"], derivative: int
) -> Float[Array, "mode"]:
    """Derivative of the part of each mode that internal forces go with: without shear."""
    if isinstance(modes, ChangedModes):
        return bent_shapes(modes.modes, position, derivative) @ modes.bending
    return modes.shapes(position, derivative)[0]


def line_of(modes: Modes) -> UniformLine:
    """Return the uniform bar or beam below changed modes.

    Raises
    ------
    ValueError
        If there is none.
    """
    if isinstance(modes, UniformLine):
        return modes
    if isinstance(modes, ChangedModes):
        return line_of(modes.modes)
    raise InputError(
        f"This effect was added to {type(modes).__name__}, but it needs to know the section of a "
        "uniform bar or beam, which those modes do not tell. Use beams.bar or beams.beam."
    )


def nodal_below(modes: Modes) -> NodalModes:
    """Return the nodal modes below changed ones.

    Raises
    ------
    ValueError
        If there are none.
    """
    if isinstance(modes, Altered):
        return nodal_below(modes.modes)
    nodal = nodal_of(modes)
    if nodal is None:
        raise InputError(
            f"This effect was added to {type(modes).__name__}, but it needs the matrices of a "
            "finite element model. Use finite_elements.modes(matrices, ...)."
        )
    return nodal


def safe_root(value: Float[Array, "mode"]) -> Float[Array, "mode"]:
    """Root with a finite gradient at the zeros of rigid-body modes; not a number if negative."""
    zero = jnp.abs(value) < _ROUNDING * jnp.max(value)
    return jnp.where(zero, 0.0, jnp.sqrt(jnp.where(zero, 1.0, value)))
