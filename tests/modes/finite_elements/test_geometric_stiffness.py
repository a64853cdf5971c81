"""Buckling loads of columns in any direction compared with those of Euler."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from bayes_placement.modes.finite_elements.interpolation import frame_geometric_stiffness
from tests.simulator.element_models import chain, handed_over, nodes

ALL = (1, 2, 3, 4, 5, 6)


def test_a_column_of_the_portal_buckles_at_eulers_load(shared_data):
    """Its own stiffness as handed over, clamped at the foot; then held at the top too."""
    portal = handed_over(shared_data, "portal")
    stiffness = sum(portal.region(number) for number in range(4)).toarray()
    column = portal.elements[:24]
    geometric = frame_geometric_stiffness(portal, column).toarray()
    about = portal.about
    outer = about["outer_diameter_m"]
    moment = np.pi / 64 * (outer**4 - (outer - 2 * about["wall_m"]) ** 4)
    euler = np.pi**2 * about["youngs_modulus_Pa"] * moment / 0.9**2
    node = np.repeat(np.arange(25), 6)
    direction = np.tile(ALL, 25)
    ends = {
        "clamped, free": (node > 0, 1 / 4),
        "pinned, pinned": (~np.isin(node, (0, 24)) | (direction > 3) & (direction < 6), 1),
        "clamped, clamped": (~np.isin(node, (0, 24)), 4),
    }
    for free, factor in ends.values():
        rows = np.flatnonzero(free)
        block = np.ix_(rows, rows)
        softest = eigh(geometric[block], stiffness[block], eigvals_only=True)[-2:]
        np.testing.assert_allclose(1 / softest, factor * euler, rtol=1e-5)  # in both planes


def test_it_is_that_of_another_library():
    skfem = pytest.importorskip("skfem", reason="scikit-fem is not installed")
    x = np.array([0.0, 0.3, 0.5, 1.1])
    basis = skfem.Basis(skfem.MeshLine(x), skfem.ElementLineHermite())
    slopes = skfem.BilinearForm(lambda u, v, _: u.grad[0] * v.grad[0])
    expected = slopes.assemble(basis).toarray()  # w and w' at each node
    stiffness = frame_geometric_stiffness(nodes(np.outer(x, [1, 0, 0]), ALL), chain(4)).toarray()
    for shift, turn, sign in ((2, 4, -1.0), (1, 5, 1.0)):  # theta_y = -w', theta_z = v'
        rows = (6 * np.arange(4)[:, None] + [shift, turn]).ravel()
        signs = np.tile([1.0, sign], 4)
        np.testing.assert_allclose(
            stiffness[np.ix_(rows, rows)] * np.outer(signs, signs), expected, atol=1e-12
        )
    assert not stiffness[0::6].any() and not stiffness[3::6].any()


def test_turning_the_coordinate_system_turns_it():
    turned = Rotation.random(rng=2).as_matrix()
    position = np.array([[0, 0, 0], [0, 1.0, 0], [0.5, 1.2, 0.3]])
    blocks = np.kron(np.eye(6), turned)
    before = frame_geometric_stiffness(nodes(position, ALL), chain(3)).toarray()
    after = frame_geometric_stiffness(nodes(position @ turned.T, ALL), chain(3)).toarray()
    np.testing.assert_allclose(after, blocks @ before @ blocks.T, atol=1e-12)
    np.testing.assert_allclose(before, before.T, atol=1e-15)


def test_a_rigid_rotation_stores_tension_times_length():
    """Turned by a small angle, a stretched member rises by half its length times its square."""
    model = nodes([[0, 0, 0], [0.3, 0.4, 0], [0.6, 0.8, 0]], ALL)
    turn = np.array([0.0, 0.0, 1.0])
    motion = np.column_stack([np.cross(turn, model.position), np.tile(turn, (3, 1))]).ravel()
    geometric = frame_geometric_stiffness(model, chain(3))
    assert motion @ (geometric @ motion) == pytest.approx(1.0)


def test_a_member_without_rotations_is_refused():
    with pytest.raises(ValueError, match="has no degree of freedom in direction 4"):
        frame_geometric_stiffness(nodes([[0, 0, 0], [1, 0, 0]], (1, 2, 3)), chain(2))
