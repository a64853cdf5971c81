"""Rotation matrices are proper and equal those of SciPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bayes_placement.positions.vectors import rotation, unit_vector

ANGLES = np.random.default_rng(5).uniform(-3, 3, (20, 3))
rotations = jax.jit(jax.vmap(rotation))


def test_rotations_are_proper():
    matrices = np.asarray(rotations(ANGLES))
    products = matrices @ np.swapaxes(matrices, 1, 2)
    np.testing.assert_allclose(products, np.broadcast_to(np.eye(3), (20, 3, 3)), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(matrices), 1.0, rtol=1e-14)


def test_rotations_are_intrinsic_about_x_then_y_then_z():
    expected = Rotation.from_euler("XYZ", ANGLES).as_matrix()
    np.testing.assert_allclose(rotations(ANGLES), expected, atol=1e-14)


def test_one_angle_alone_turns_about_its_axis():
    turned = rotations(0.3 * np.eye(3))
    cosine, sine = np.cos(0.3), np.sin(0.3)
    np.testing.assert_allclose(turned[0] @ jnp.eye(3)[1], [0, cosine, sine], atol=1e-15)
    np.testing.assert_allclose(turned[1] @ jnp.eye(3)[2], [sine, 0, cosine], atol=1e-15)
    np.testing.assert_allclose(turned[2] @ jnp.eye(3)[0], [cosine, sine, 0], atol=1e-15)


def test_no_angle_turns_nothing():
    np.testing.assert_array_equal(rotation(jnp.zeros(3)), np.eye(3))


@pytest.mark.parametrize(
    ("direction", "vector"), [(1, [1, 0, 0]), (-2, [0, -1, 0]), (3, [0, 0, 1]), (-3, [0, 0, -1])]
)
def test_recorded_directions_are_unit_vectors(direction, vector):
    np.testing.assert_array_equal(unit_vector(direction), vector)
