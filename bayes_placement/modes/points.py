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
    shape_error
        What is added to the shapes of the first modes there [kg^-1/2]; None where they are exact.
    """

    position: Float[Array, "point *coordinate"]
    direction: Float[Array | np.ndarray, "point axis"]
    shape_error: Float[Array, "point erroneous"] | None = None

    def shapes(self, modes: Modes) -> Float[Array, "point mode"]:
        """Mass-normalised mode shapes [kg^-1/2] along the directions."""
        return self.with_error(self.exact_shapes(modes))

    def exact_shapes(self, modes: Modes) -> Float[Array, "point mode"]:
        """Mass-normalised mode shapes [kg^-1/2] of the model, without error."""
        return jnp.einsum("pa,pam->pm", self.direction, jax.vmap(modes.shapes)(self.position))

    def with_error(self, exact: Float[Array, "point mode"]) -> Float[Array, "point mode"]:
        """Shapes with their error added."""
        if self.shape_error is None:
            return exact
        return exact.at[:, : self.shape_error.shape[1]].add(self.shape_error)

    def static_flexibility(
        self, modes: Modes, other: "Points"
    ) -> Float[Array, "point other"] | None:
        """Static flexibility [m/N] between these and other points; None if not known."""
        over_other = jax.vmap(modes.static_flexibility, in_axes=(None, 0))
        flexibility = jax.vmap(over_other, in_axes=(0, None))(self.position, other.position)
        if flexibility is None:
            return None
        return jnp.einsum("pa,poab,ob->po", self.direction, flexibility, other.direction)

    def flexibility_left_out(self, modes: Modes, other: "Points") -> Float[Array, "point other"]:
        """Static flexibility [m/N] of the modes left out; zero where it is not known."""
        static = self.static_flexibility(modes, other)
        if static is None:
            return jnp.zeros((self.position.shape[0], other.position.shape[0]))
        elastic = slice(modes.rigid_body_modes, None)
        scaled_shapes = (
            self.exact_shapes(modes)[:, elastic] / modes.angular_frequency()[elastic] ** 2
        )
        return static - scaled_shapes @ other.exact_shapes(modes)[:, elastic].T


def joined(groups: Sequence[Points]) -> Points:
    """Return all points in one list."""
    # Known directions become one constant, which needs no compilation.
    known = all(isinstance(points.direction, np.ndarray) for points in groups)
    concatenate = np.concatenate if known else jnp.concatenate
    return Points(
        jnp.concatenate([points.position for points in groups]),
        concatenate([points.direction for points in groups]),
        _joined_errors(groups),
    )


def _joined_errors(groups: Sequence[Points]) -> Float[Array, "point erroneous"] | None:
    """Shape errors of all points, zero for those whose shapes are exact."""
    widths = [points.shape_error.shape[1] for points in groups if points.shape_error is not None]
    if not widths:
        return None
    errors = [
        jnp.zeros((points.position.shape[0], widths[0]))
        if points.shape_error is None
        else points.shape_error
        for points in groups
    ]
    return jnp.concatenate(errors)


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
