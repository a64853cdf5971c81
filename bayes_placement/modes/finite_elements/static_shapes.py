"""static_shapes: in, numbers of what may give way; out, its static shapes beside the modes.

Not known here: matrices, how softly anything gives way, how shapes are read between nodes.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._types import InputError

Square = Float[np.ndarray | Array, "pattern pattern"]


class StaticShapes(eqx.Module):
    """Static shapes Psi where parts of a structure give way, beside its modes Phi.

    The parts are supports that are soft, regions that lose stiffness, members under tension, in
    this order. Each has as many patterns, side by side; patterns of nothing fill up. What Phi
    lacks of Psi, turned into X, is within each part mass-orthonormal and of diagonal flexibility.

    Parameters
    ----------
    shape
        What Phi lacks of Psi, at the rows that are read.
    participation
        Phi^T M Psi.
    turn
        Combinations of what is lacking that are X [kg^-1/2].
    share
        X^T M Psi.
    mass
        X^T M X: 1 within a part.
    flexibility
        X^T M K^-1 M X [s^2].
    reaction
        Stiffness of the structure against the patterns, over that of a unit spring in them.
    tension
        Tension [N] of each member at which its geometric stiffness is such a spring.
    supports, regions, members
        Names.
    """

    shape: Float[np.ndarray | Array, "row pattern"]
    participation: Float[np.ndarray | Array, "mode pattern"]
    turn: Square
    share: Square
    mass: Square
    flexibility: Square
    reaction: Square
    tension: Float[np.ndarray | Array, "member"]
    supports: tuple[str, ...] = eqx.field(static=True)
    regions: tuple[str, ...] = eqx.field(static=True)
    members: tuple[str, ...] = eqx.field(static=True)

    @property
    def each(self) -> int:
        """Number of patterns of one part."""
        parts = len(self.supports) + len(self.regions) + len(self.members)
        return self.shape.shape[1] // max(parts, 1)

    def patterns(self, parts: Int[Array, "part"]) -> Int[Array, "pattern"]:
        """Patterns of some parts, by the numbers of these."""
        return (parts[:, None] * self.each + np.arange(self.each)).reshape(-1)

    def of(self, patterns: Int[Array, "some"]) -> "StaticShapes":
        """Only some patterns; to what they belong is not told."""
        block = (patterns[:, None], patterns)
        return StaticShapes(
            shape=jnp.asarray(self.shape)[:, patterns],
            participation=jnp.asarray(self.participation)[:, patterns],
            turn=jnp.asarray(self.turn)[block],
            share=jnp.asarray(self.share)[block],
            mass=jnp.asarray(self.mass)[block],
            flexibility=jnp.asarray(self.flexibility)[block],
            reaction=jnp.asarray(self.reaction)[block],
            tension=jnp.zeros(0),
            supports=(),
            regions=(),
            members=(),
        )

    def softest(self) -> Float[np.ndarray, "support"]:
        """Least stiffness of the structure against a pattern of each support."""
        own = np.diag(np.asarray(self.reaction)).reshape(-1, max(self.each, 1))
        return np.array([one[one > 0].min() for one in own[: len(self.supports)]])

    def support(self, name: str) -> int:
        """Return the number of a support.

        Raises
        ------
        ValueError
            If no support of that name may give way.
        """
        if name not in self.supports:
            raise InputError(
                f'The support "{name}" was named, but of the model '
                f"{', '.join(self.supports) or 'none'} may give way. Name one of these; they come "
                'with the modes: finite_elements.modes(..., soft={"'
                f'{name}": soft_supports.rotations(matrices, node)}}).'
            )
        return self.supports.index(name)


def none(rows: int, modes: int) -> StaticShapes:
    """Nothing that could give way."""
    empty = np.zeros((0, 0))
    return StaticShapes(
        np.zeros((rows, 0)),
        np.zeros((modes, 0)),
        *(empty, empty, empty, empty, empty),
        tension=np.zeros(0),
        supports=(),
        regions=(),
        members=(),
    )
