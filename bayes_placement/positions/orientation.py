"""orientation: in, three Euler angles [rad]; out, the rotation matrix and directions in space.

Not known here: positions, structures, probability. One convention for the whole package.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


def rotation(angles: Float[Array, "3"]) -> Float[Array, "3 3"]:
    r"""Rotation matrix R = R_x(t_x) R_y(t_y) R_z(t_z), active and right-handed.

    Column j is the true direction, in global axes, of the axis recorded as j. This is Eq. (10)
    of the paper with its entry (1, 2) corrected to -C_y S_z, without which R is not orthogonal.

    Parameters
    ----------
    angles
        Euler angles t_x, t_y, t_z [rad].
    """
    cx, cy, cz = jnp.cos(angles)
    sx, sy, sz = jnp.sin(angles)
    return jnp.array(
        [
            [cy * cz, -cy * sz, sy],
            [sz * cx + sx * sy * cz, cz * cx - sx * sy * sz, -sx * cy],
            [sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy],
        ]
    )


def unit_vector(direction: int) -> Float[np.ndarray, "3"]:
    """Unit vector of a recorded direction, +-1, +-2 or +-3 for +-x, +-y or +-z."""
    sign = 1.0 if direction > 0 else -1.0
    return sign * np.eye(3)[abs(direction) - 1]
