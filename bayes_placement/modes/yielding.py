"""yielding: in, modes of a finite element model and what gives way; out, the modes then.

Not known here: sparse matrices, how shapes are read between nodes, damping, data.
"""

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._types import InputError, Parameter
from .changed import changed, mixed, nodal_below
from .finite_elements.interpolation import Interpolation
from .finite_elements.nodal_modes import NodalModes
from .finite_elements.static_shapes import StaticShapes
from .modes import Modes
from .opened import Lacking, OpenedModes, Opening, opened

Number: TypeAlias = int | Int[Array | np.ndarray, ""]
Matrix: TypeAlias = Float[Array, "rows columns"]

_AGREEING = 1e-6  # of a modal mass, below which a combination of shapes counts as none


class SoftenedSupport(NamedTuple):
    """A support that gives way.

    Parameters
    ----------
    support
        Its number.
    spring
        Compliance of the spring that it is then: [rad/(N m)] in a rotation, [m/N] in a
        translation, [m^2/N] along an edge.
    """

    support: Number
    spring: Parameter

    def part(self, statics: StaticShapes) -> Number:
        """Its number among all that may give way."""
        return self.support

    def compliance(self, nodal: NodalModes) -> Float[Array, ""]:
        """Compliance in unit patterns."""
        return jnp.asarray(self.spring, float)

    def known(self, statics: StaticShapes) -> bool:
        """Tell whether its static shapes are known."""
        return bool(statics.supports)

    def stiffness(self, nodal: NodalModes) -> Matrix:
        """Raise, since a support is not in the modes at all.

        Raises
        ------
        ValueError
            Always.
        """
        raise InputError(
            "A support was to give way, but its static shapes are not known beside these modes: "
            "they are those of one stiffness matrix, which only youngs_modulus and density may "
            "scale. Use finite_elements.modes(matrices, ..., soft={...})."
        )


class WeakenedRegion(NamedTuple):
    """A region that loses a share of its stiffness.

    Parameters
    ----------
    region
        Its number.
    loss
        The share [1].
    """

    region: Number
    loss: Parameter

    def part(self, statics: StaticShapes) -> Number:
        """Its number among all that may give way."""
        return len(statics.supports) + jnp.asarray(self.region)

    def compliance(self, nodal: NodalModes) -> Float[Array, ""]:
        """Compliance in unit patterns."""
        return _lost(self.loss) / nodal.stiffening()

    def known(self, statics: StaticShapes) -> bool:
        """Tell whether its static shapes are known."""
        return bool(statics.regions)

    def stiffness(self, nodal: NodalModes) -> Matrix:
        """Stiffness [(rad/s)^2] that it adds over the modes."""
        own = jnp.asarray(nodal.regions.matrices)[self.region]
        return -self.loss * own * nodal.stiffening() / nodal.heaviness()


class StretchedMember(NamedTuple):
    """A member under tension: a region of geometric stiffness that gains a share of it.

    Parameters
    ----------
    member
        Its number.
    tension
        Tension [N].
    """

    member: Number
    tension: Parameter

    def part(self, statics: StaticShapes) -> Number:
        """Its number among all that may give way."""
        return len(statics.supports) + len(statics.regions) + jnp.asarray(self.member)

    def compliance(self, nodal: NodalModes) -> Float[Array, ""]:
        """Compliance in unit patterns."""
        unit = jnp.asarray(nodal.statics.tension)[self.member] * nodal.stiffening()
        return _lost(-self.tension / unit) / nodal.stiffening()

    def known(self, statics: StaticShapes) -> bool:
        """Tell whether its static shapes are known."""
        return bool(statics.members)

    def stiffness(self, nodal: NodalModes) -> Matrix:
        """Stiffness [(rad/s)^2] that it adds over the modes."""
        return self.tension * jnp.asarray(nodal.members.matrices)[self.member] / nodal.heaviness()


Yielding: TypeAlias = SoftenedSupport | WeakenedRegion | StretchedMember


def _lost(share: Parameter) -> Float[Array, ""]:
    """Compliance that stands for a lost share of a unit stiffness, q / (1 - q)."""
    lost = jnp.asarray(share, float)
    return lost / (1 - lost)


class _OfStatics(Lacking):
    """What the modes of a model lack of its static shapes."""

    interpolation: Interpolation
    shape: Float[Array, "row pattern"]

    def shapes(
        self,
        position: Float[Array, "*coordinate"],
        derivative: int,
        kept: Float[Array, "axis mode"],
    ) -> Float[Array, "axis pattern"]:
        """Shapes of the patterns, without their part in the modes."""
        reading = self.interpolation.at(position)
        return reading.weight @ self.shape[reading.rows]


def yielded(modes: Modes, several: Sequence[Yielding]) -> Modes:
    """Let parts of a finite element model give way, all at once.

    Where static shapes are not known, in the span of the kept modes, by the procedure of Ritz.

    Raises
    ------
    ValueError
        If a support gives way whose static shapes are not known.
    """
    nodal = nodal_below(modes)
    if modes is nodal and all(one.known(nodal.statics) for one in several):
        return _opened(nodal, several)
    added = [mixed(modes, one.stiffness(nodal)) for one in several]
    return changed(modes, jnp.sum(jnp.stack(added), axis=0))


def _opened(nodal: NodalModes, several: Sequence[Yielding]) -> OpenedModes:
    statics, stiff, heavy = nodal.statics, nodal.stiffening(), nodal.heaviness()
    parts = jnp.stack([jnp.asarray(one.part(statics)) for one in several])
    each = jnp.stack([one.compliance(nodal) for one in several])
    chosen = statics.of(statics.patterns(parts))
    turn, share, beyond = _orthonormal(chosen, len(several))
    opening = Opening(
        participation=jnp.sqrt(heavy) * jnp.asarray(chosen.participation)[nodal.rigid_body_modes :],
        orthonormal=turn / jnp.sqrt(heavy),
        share=jnp.sqrt(heavy) * share,
        beyond=heavy / stiff * beyond,
        in_series=_in_series(jnp.repeat(each, statics.each), stiff * jnp.asarray(chosen.reaction)),
    )
    return opened(nodal, _OfStatics(nodal.interpolation, jnp.asarray(chosen.shape)), opening)


def _orthonormal(chosen: StaticShapes, parts: int) -> tuple[Matrix, Matrix, Matrix]:
    """What the modes lack, mass-orthonormal: its turn, its share of the shapes, its flexibility."""
    turn, share, beyond, mass = (
        jnp.asarray(one) for one in (chosen.turn, chosen.share, chosen.flexibility, chosen.mass)
    )
    if parts == 1:
        return turn, share, beyond
    # Shapes of several parts may nearly agree in what the modes lack of them.
    values, vectors = jnp.linalg.eigh(jax.lax.stop_gradient(mass))
    unit = jnp.where(values > _AGREEING, vectors / jnp.sqrt(jnp.abs(values)), 0.0)
    return turn @ unit, unit.T @ share, unit.T @ beyond @ unit


def _in_series(
    compliance: Float[Array, "pattern"], reaction: Float[Array, "pattern pattern"]
) -> Float[Array, "pattern pattern"]:
    """Compliances in series with the reactions of the structure, C (1 + S C)^-1."""
    springs = jnp.diag(compliance)
    found = jnp.linalg.solve(jnp.eye(compliance.size) + springs @ reaction, springs)
    return (found + found.T) / 2
