"""Interpolation in elements: exact for their fields, smooth, independent of the axes."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bayes_placement.modes.finite_elements import interpolation
from tests.simulator.element_models import chain, closest, handed_over, nodes, slopes, weights

ALL = (1, 2, 3, 4, 5, 6)
PLATE = (3, 4, 5, 7)


@pytest.fixture(scope="module")
def portal(shared_data):
    return handed_over(shared_data, "portal")


@pytest.fixture(scope="module")
def plate(shared_data):
    return handed_over(shared_data, "plate")


@pytest.fixture(scope="module")
def rng():
    return np.random.default_rng(7)


@pytest.fixture(scope="module")
def zigzag():
    """Three members in space, one along y, of two elements each."""
    corner = np.array([[0.2, -0.1, 0.3], [0.2, 1.0, 0.3], [1.1, 1.3, -0.2], [0.9, 0.4, -0.9]])
    position = np.concatenate([np.linspace(a, b, 3)[:-1] for a, b in itertools.pairwise(corner)])
    return nodes(np.vstack([position, corner[-1:]]), ALL)


@pytest.fixture(scope="module")
def tiles():
    """Plate of unequal rectangles at z = 0.1, corners in no order."""
    x, y = np.array([-0.2, 0.1, 0.2, 0.6]), np.array([0.0, 0.3, 0.4])
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    model = nodes(np.column_stack([grid, np.full(len(grid), 0.1)]), PLATE)
    lower = np.array([3 * i + j for i in range(3) for j in range(2)])
    model.elements = lower[:, None] + np.array([4, 0, 1, 3])
    return model


def along(model, elements, rng, count):
    """Places on elements of two nodes."""
    ends = model.position[rng.choice(elements, count)]
    share = rng.uniform(size=(count, 1))
    return (1 - share) * ends[:, 0] + share * ends[:, 1]


def on_tiles(rng, count):
    return np.column_stack([rng.uniform([-0.2, 0.0], [0.6, 0.4], (count, 2)), np.full(count, 0.1)])


# ---------------------------------------------------------------- handed-over models


def test_shapes_at_nodes_are_those_handed_over(portal, plate):
    for model, read, axes in (
        (portal, interpolation.frame, (1, 2, 3)),
        (plate, interpolation.plate, (3,)),
    ):
        shapes = weights(read(model, model.elements), model.position, len(model.dof)) @ model.shape
        for axis, direction in enumerate(axes):
            np.testing.assert_array_equal(
                shapes[:, axis], model.shape[model.dof[:, 1] == direction], strict=True
            )


def test_the_frame_has_the_mass_that_was_handed_over(portal):
    """The integral of the readings' products is the consistent mass matrix, torsion apart."""
    about = portal.about
    outer = about["outer_diameter_m"]
    area = np.pi / 4 * (outer**2 - (outer - 2 * about["wall_m"]) ** 2)
    point, weight = np.polynomial.legendre.leggauss(4)
    ends = portal.position[portal.elements]
    place = ends[:, :1] + (point[:, None] + 1) / 2 * (ends[:, 1:] - ends[:, :1])
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    share = (about["density_kg_m3"] * area * length[:, None] * weight / 2).ravel()
    read = interpolation.frame(portal, portal.elements)
    shapes = weights(read, place.reshape(-1, 3), len(portal.dof))
    mass = np.einsum("p,pai,paj->ij", share, shapes, shapes, optimize=True)
    difference = np.abs(portal.mass.toarray() - mass)
    about_axis = np.isin(portal.dof[:, 1], (4, 6))  # members along z and x twist about them
    assert difference[~about_axis][:, ~about_axis].max() < 1e-12 * mass.max()
    middle = (portal.dof[:, 1] == 6) & (portal.position[portal.dof[:, 0] - 1][:, 2] > 0.899)
    inside = middle & (np.abs(portal.position[portal.dof[:, 0] - 1][:, 0] - 0.6) < 0.55)
    assert difference[inside].max() < 1e-12 * mass.max()


def test_the_plate_has_the_mass_that_was_handed_over(plate):
    about = plate.about
    point, weight = np.polynomial.legendre.leggauss(4)
    low, side = plate.position[plate.elements].min(axis=1), np.array([0.02, 0.02, 0.0])
    pairs = np.stack([*np.meshgrid(point, point), np.ones((4, 4))], axis=-1).reshape(-1, 3)
    place = low[:60, None] + (pairs + 1) / 2 * side
    areal = about["density_kg_m3"] * about["thickness_m"] * np.prod(side[:2]) / 4
    share = np.tile(np.outer(weight, weight).ravel() * areal, 60)
    read = interpolation.plate(plate, plate.elements)
    shapes = weights(read, place.reshape(-1, 3), len(plate.dof))[:, 0]
    mass = (shapes * share[:, None]).T @ shapes
    inner = 4 * np.arange(16 * 3 + 3, 16 * 3 + 9)[:, None] + np.arange(4)  # all elements around
    rows = inner.ravel()
    expected = plate.mass.toarray()[rows]
    assert np.abs(mass[rows] - expected).max() < 1e-12 * expected.max()


# ---------------------------------------------------------------- exact fields


def test_rigid_motion_of_a_frame_is_exact(zigzag, rng):
    shift, turn = rng.normal(size=(2, 3))
    moved = np.column_stack(
        [shift + np.cross(turn, zigzag.position), np.tile(turn, (len(zigzag.position), 1))]
    )
    elements = chain(7)
    place = along(zigzag, elements, rng, 40)
    motion = weights(interpolation.frame(zigzag, elements), place, len(zigzag.dof)) @ moved.ravel()
    np.testing.assert_allclose(motion, shift + np.cross(turn, place), atol=1e-14)


def test_constant_curvature_and_stretch_of_a_member_are_exact(rng):
    unit, bent = Rotation.random(rng=3).as_matrix()[:2]
    arc = np.array([0.0, 0.3, 0.4, 0.9])
    model = nodes(arc[:, None] * unit, ALL)

    def motion(s):
        return np.outer(s**3, bent) + np.outer(0.7 * s, unit)

    turn = np.outer(3 * arc**2, np.cross(unit, bent))
    values = np.column_stack([motion(arc), turn]).ravel()
    s = rng.uniform(0, 0.9, 30)
    displacement = weights(interpolation.frame(model, chain(4)), np.outer(s, unit), 24) @ values
    np.testing.assert_allclose(displacement, motion(s), atol=1e-14)


@pytest.mark.parametrize("powers", [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 2), (3, 3)])
def test_a_plate_holds_bicubic_deflections(tiles, rng, powers):
    from numpy.polynomial import polynomial

    term = np.zeros((4, 4))
    term[powers] = 1.0

    def value(place, in_x=0, in_y=0):
        derived = polynomial.polyder(polynomial.polyder(term, in_x, axis=0), in_y, axis=1)
        return polynomial.polyval2d(place[:, 0], place[:, 1], derived)

    at = tiles.position
    nodal = np.stack([value(at), value(at, 0, 1), -value(at, 1, 0), value(at, 1, 1)], axis=1)
    place = on_tiles(rng, 30)
    shapes = weights(interpolation.plate(tiles, tiles.elements), place, len(tiles.dof))
    np.testing.assert_allclose(shapes[:, 0] @ nodal.ravel(), value(place), atol=1e-14)


@pytest.mark.parametrize("corners", [2, 3, 4])
def test_linear_fields_are_exact_between_corners(rng, corners):
    position = rng.normal(size=(corners + 1, 3))
    model = nodes(position, (1, 2, 3))
    elements = np.array([np.arange(corners), np.arange(1, corners + 1)])
    slope = rng.normal(size=(3, 3))
    share = rng.dirichlet(np.ones(corners), 20)
    place = np.concatenate([share @ position[element] for element in elements])
    read = interpolation.linear(model, elements)
    field = weights(read, place, len(model.dof)) @ (position @ slope).ravel()
    if corners == 4:  # the two tetrahedra may overlap; a linear field is the same in both
        assert field.shape == (40, 3)
    np.testing.assert_allclose(field, place @ slope, atol=1e-12)


# ---------------------------------------------------------------- smoothness


def test_slopes_are_continuous_across_borders(tiles, zigzag, rng):
    values = rng.normal(size=len(tiles.dof))
    border = np.array([[0.1, 0.15, 0.1], [0.2, 0.31, 0.1], [0.4, 0.3, 0.1], [0.0, 0.3, 0.1]])
    aside = 1e-11 * np.array([[1.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0]])
    read = interpolation.plate(tiles, tiles.elements)
    sides = [slopes(read, border + s * aside, len(tiles.dof)) @ values for s in (-1, 1)]
    np.testing.assert_allclose(*sides, atol=1e-6)
    middle, values = zigzag.position[[1, 3, 5]], rng.normal(size=len(zigzag.dof))
    step = 1e-11 * (zigzag.position[[2, 4, 6]] - middle)
    read = interpolation.frame(zigzag, chain(7))
    across = [slopes(read, middle + s * step, len(zigzag.dof)) @ values for s in (-1, 1)]
    unit = step / np.linalg.norm(step, axis=1, keepdims=True)
    derivatives = [np.einsum("pac,pc->pa", slope, unit) for slope in across]
    transverse = [
        derivative - unit * np.sum(derivative * unit, axis=1, keepdims=True)
        for derivative in derivatives
    ]
    np.testing.assert_allclose(*transverse, atol=1e-6)


def test_slopes_at_nodes_are_the_rotations_there(tiles, plate, rng):
    """Nodes are where sensors are glued: there no gradient may be halved or lost by rounding."""
    for model in (tiles, plate):
        values = rng.normal(size=len(model.dof))
        read = interpolation.plate(model, model.elements)
        middle = model.position.mean(axis=0)
        place = middle + (1 + 1e-13) * (model.position - middle)  # some just outside
        gradients = slopes(read, place, len(model.dof)) @ values
        w_y, w_x = values[model.dof[:, 1] == 4], -values[model.dof[:, 1] == 5]
        np.testing.assert_allclose(
            gradients[:, 0], np.stack([w_x, w_y, 0 * w_x], axis=1), atol=1e-7
        )


def test_gradients_are_those_of_finite_differences(tiles, zigzag, rng):
    for read, place, size in (
        (interpolation.plate(tiles, tiles.elements), on_tiles(rng, 10), len(tiles.dof)),
        (interpolation.frame(zigzag, chain(7)), along(zigzag, chain(7), rng, 10), len(zigzag.dof)),
    ):
        gradients = slopes(read, place, size)
        for axis, step in enumerate(1e-6 * np.eye(3)):
            ends = [weights(read, place + sign * step, size) for sign in (-1, 1)]
            np.testing.assert_allclose(
                gradients[:, :, axis], (ends[1] - ends[0]) / 2e-6, atol=1e-7, rtol=1e-6
            )


@pytest.mark.parametrize("kind, rate", [("nearest", 1), ("linear", 2), ("frame", 4)])
def test_refining_the_mesh_converges_at_the_rate_of_its_elements(kind, rate):
    place = np.column_stack([np.linspace(0.013, 0.987, 301), np.zeros((301, 2))])
    error = []
    for count in (9, 17, 33):
        x = np.linspace(0, 1, count)
        model = nodes(np.column_stack([x, np.zeros((count, 2))]), ALL)
        values = np.zeros((count, 6))
        values[:, 2], values[:, 4] = np.sin(5 * x), -5 * np.cos(5 * x)
        elements = () if kind == "nearest" else (chain(count),)
        read = getattr(interpolation, kind)(model, *elements)
        deflection = weights(read, place, values.size)[:, 2] @ values.ravel()
        error.append(np.sqrt(np.mean((deflection - np.sin(5 * place[:, 0])) ** 2)))
    np.testing.assert_allclose(np.log2(np.array(error[:-1]) / error[1:]), rate, atol=0.15)


# ---------------------------------------------------------------- coordinate systems, borders


def test_moving_the_coordinate_system_changes_nothing(portal, rng):
    turned, shift = Rotation.random(rng=5).as_matrix(), np.array([3.0, -2.0, 0.5])
    moved = nodes(portal.position @ turned.T + shift, ALL)
    shape = portal.shape[:, :8].reshape(-1, 2, 3, 8)
    shape = np.einsum("ab,nkbm->nkam", turned, shape).reshape(len(moved.dof), 8)
    place = along(portal, portal.elements, rng, 50)
    before = weights(interpolation.frame(portal, portal.elements), place, len(portal.dof))
    read = interpolation.frame(moved, portal.elements)
    after = weights(read, place @ turned.T + shift, len(moved.dof)) @ shape
    expected = np.einsum("ab,pbm->pam", turned, before @ portal.shape[:, :8])
    np.testing.assert_allclose(after, expected, atol=1e-12)


def test_outside_the_structure_the_closest_place_is_read(tiles, zigzag):
    plate = interpolation.plate(tiles, tiles.elements)
    frame = interpolation.frame(zigzag, chain(7))
    outside = np.array([[0.7, 0.2, 0.3], [0.6 + 1e-15, 0.4, 0.1], [-0.2, -1e-15, 0.1]])
    inside = np.array([[0.6, 0.2, 0.1], [0.6, 0.4, 0.1], [-0.2, 0.0, 0.1]])
    points = closest(plate, outside)
    np.testing.assert_allclose(points, inside, atol=1e-14)
    size = len(tiles.dof)
    np.testing.assert_allclose(
        weights(plate, outside, size), weights(plate, inside, size), atol=1e-5
    )
    points = closest(frame, [[0.1, 0.5, 0.45]])[0]
    np.testing.assert_allclose(points, [0.2, 0.5, 0.3], atol=1e-14)


def test_outside_a_triangle_its_border_is_read():
    model = nodes([[0, 0, 0], [1, 0, 0], [0, 1, 0]], (1, 2, 3))
    read = interpolation.linear(model, np.array([[0, 1, 2]]))
    place = [[0.7, 0.7, 0.2], [-0.3, 0.4, 0.0], [0.2, 0.3, -1.0]]
    points = closest(read, place)
    np.testing.assert_allclose(points, [[0.5, 0.5, 0], [0, 0.4, 0], [0.2, 0.3, 0]], atol=1e-15)


# ---------------------------------------------------------------- parts of a model


@pytest.mark.parametrize("radius, share", [(0.004, 0.2), (0.06, 0.9)])
def test_near_reads_the_same_with_less(plate, rng, radius, share):
    reading = interpolation.plate(plate, plate.elements)
    centre = np.array([[0.0595, 0.0605, 0.0], [0.3, 0.2, 0.0]])
    part = reading.near(centre, radius)
    angle = rng.uniform(0, 2 * np.pi, 60)
    circle = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    place, size = np.tile(centre, (30, 1)) + circle, len(plate.dof)
    np.testing.assert_array_equal(weights(part, place, size), weights(reading, place, size))
    assert len(part.rows) < share * len(reading.rows)


def test_rows_can_be_renumbered(plate):
    reading = interpolation.plate(plate, plate.elements)
    part = reading.near(np.array([[0.3, 0.2, 0.0]]), 0.01)
    rows = part.used_rows()
    place = np.array([[0.303, 0.196, 0.0]])
    values = weights(part.renumbered(rows), place, len(rows)) @ plate.shape[rows]
    np.testing.assert_array_equal(values, weights(reading, place, len(plate.dof)) @ plate.shape)
    with pytest.raises(ValueError, match=r"interpolation\.used_rows\(\)"):
        part.renumbered(rows[1:])


# ---------------------------------------------------------------- errors


def test_an_element_that_names_no_node_is_refused(zigzag):
    with pytest.raises(ValueError, match="indices 0 to 6 into `node`"):
        interpolation.frame(zigzag, chain(8))
    with pytest.raises(ValueError, match=r"elements of shape \(0, 2\) was given"):
        interpolation.frame(zigzag, np.zeros((0, 2), dtype=int))


def test_a_missing_degree_of_freedom_is_named(tiles):
    solid = nodes([[0, 0, 0], [1, 0, 0]], (1, 2, 3))
    with pytest.raises(ValueError, match=r"Node 21 has no degree of freedom in direction 4"):
        interpolation.frame(solid, chain(2))


def test_an_element_without_length_is_refused():
    model = nodes([[0, 0, 0], [1, 0, 0], [1, 0, 0]], ALL)
    with pytest.raises(ValueError, match=r"np\.delete\(elements, 1, axis=0\)"):
        interpolation.frame(model, chain(3))


@pytest.mark.parametrize("corner", [[1, 1, 0], [2, 0.9, 0], [1, 0.9, 0.2], [0, 0.9, 0]], ids=str)
def test_a_plate_element_that_is_no_rectangle_is_refused(corner):
    corners = [[0, 0, 0], [1, 0, 0], [0, 0.9, 0]]
    model = nodes([*corners, corner], PLATE)
    with pytest.raises(ValueError, match=r"element 0 are no rectangle"):
        interpolation.plate(model, np.array([[0, 1, 2, 3]]))


def test_linear_elements_of_other_shapes_are_refused():
    model = nodes(np.eye(5, 3), (1, 2, 3))
    with pytest.raises(ValueError, match="Elements with 5 corners were given"):
        interpolation.linear(model, np.array([[0, 1, 2, 3, 4]]))
