"""A small structure in space whose mode shapes are linear in position."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from bayes_placement.modes.modes import Modes

BOUNDS = ((0.0, 0.0, 0.0), (1.0, 0.8, 0.6))
CONSTANT = np.array([[0.3, -0.7, 1.1], [-0.5, 0.9, 0.2], [1.3, 0.4, -0.6]])
SLOPE = np.array(
    [
        [[0.9, -1.2, 0.4], [0.3, 0.8, -1.5], [-0.6, 0.5, 0.7]],
        [[-0.8, 0.6, 1.4], [1.1, -0.3, 0.5], [0.2, -0.9, 0.8]],
        [[0.5, 1.3, -0.4], [-0.7, 0.6, 0.9], [1.2, -0.2, 0.3]],
    ]
)


class Linear(Modes):
    """Three modes; along each axis a constant and a slope in x, y and z."""

    axes: tuple[int, ...] = eqx.field(static=True, default=(1, 2, 3))
    box: tuple = eqx.field(static=True, default=BOUNDS)
    rigid_body_modes: int = eqx.field(static=True, default=0)

    def angular_frequency(self):
        return 2 * np.pi * jnp.array([40.0, 70.0, 110.0])

    def shapes(self, position, derivative=0):
        assert position.shape == (3,)
        along = [axis - 1 for axis in self.axes]
        return jnp.asarray(CONSTANT[along] + 0.0) + SLOPE[along] @ position

    def static_flexibility(self, position, other):
        return None

    def bounds(self):
        return self.box


def shapes(position):
    """Return all three axes of the shapes, [axis, mode], by NumPy alone."""
    return CONSTANT + SLOPE @ np.asarray(position)
