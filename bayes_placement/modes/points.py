"""Points of a structure, each with one direction, and the mode shapes there."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .modes import Modes


class Points(eqx.Module):
    """Points where a structure is read, driven or held, each along one direction.

    Parameters
    ----------
    position
        Positions [m].
    direction
        Unit vectors, in the axes of the structure [1].
    """

    position: Float[Array, "point *coordinate"]
    direction: Float[Array | np.ndarray, "point axis"]

    def shapes(self, modes: Modes) -> Float[Array, "point mode"]:
        """Mass-normalised mode shapes [kg^-1/2] along the directions."""
        return jnp.einsum("pa,pam->pm", self.direction, jax.vmap(modes.shapes)(self.position))

    def static_flexibility(
        self, modes: Modes, other: "Points"
    ) -> Float[Array, "point other"] | None:
        """Static flexibility [m/N] between these and other points; None if not known."""
        over_other = jax.vmap(modes.static_flexibility, in_axes=(None, 0))
        flexibility = jax.vmap(over_other, in_axes=(0, None))(self.position, other.position)
        if flexibility is None:
            return None
        return jnp.einsum("pa,poab,ob->po", self.direction, flexibility, other.direction)


def joined(groups: Sequence[Points]) -> Points:
    """Return all points in one list."""
    # Known directions become one constant, which needs no compilation.
    known = all(isinstance(points.direction, np.ndarray) for points in groups)
    concatenate = np.concatenate if known else jnp.concatenate
    return Points(
        jnp.concatenate([points.position for points in groups]),
        concatenate([points.direction for points in groups]),
    )


def along_axes(position: Float[Array, "*coordinate"], modes: Modes) -> Points:
    """Return one position, once along each axis of the structure."""
    count = len(modes.axes)
    repeated = jnp.broadcast_to(position, (count, *jnp.shape(position)))
    return Points(repeated, np.eye(count))


def along(
    position: Float[Array, "*coordinate"], direction: Sequence[Any] | None, modes: Modes
) -> Points:
    """Return one position along one direction, or once along each axis where there is none."""
    if direction is None:
        return along_axes(position, modes)
    vector = jnp.stack([jnp.asarray(component, float) for component in direction])
    unit = (vector / jnp.linalg.norm(vector))[np.array(modes.axes) - 1]
    return Points(position[None], unit[None])
