"""Interpolation between nodes without elements, smooth or to the nearest node."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from bayes_placement.modes.finite_elements import interpolation
from bayes_placement.modes.finite_elements.interpolation._scattered import _solution
from tests.simulator.element_models import closest, handed_over, nodes, slopes, weights


def cloud(dimension, count, seed=0):
    """Nodes near a grid, turned in space, and places between them."""
    rng = np.random.default_rng(seed)
    side = np.linspace(0, 1, count)
    grid = np.stack(np.meshgrid(*dimension * [side]), axis=-1).reshape(-1, dimension)
    grid = grid + rng.uniform(-0.2, 0.2, grid.shape) / count
    place = rng.uniform(0.0, 1.0, (40, dimension))
    turned = Rotation.random(rng=seed).as_matrix()[:dimension]
    return nodes(grid @ turned, (1, 2, 3)), place @ turned


@pytest.mark.parametrize("dimension, count", [(1, 2), (1, 12), (2, 2), (3, 5)])
def test_linear_fields_are_exact(dimension, count):
    model, place = cloud(dimension, count)
    slope = np.random.default_rng(1).normal(size=(4, 3))
    values = np.pad(model.position, [(0, 0), (0, 1)], constant_values=1.0) @ slope
    field = weights(interpolation.scattered(model), place, values.size) @ values.ravel()
    expected = np.pad(place, [(0, 0), (0, 1)], constant_values=1.0) @ slope
    np.testing.assert_allclose(field, expected, atol=1e-6)


@pytest.mark.parametrize("dimension, count", [(1, 12), (2, 9)])
def test_quadratic_fields_are_nearly_exact(dimension, count):
    model, place = cloud(dimension, count)
    curvature = np.random.default_rng(1).normal(size=(3, 3))

    def field(at):
        return np.einsum("pi,ij,pj->p", at, curvature, at)

    values = np.repeat(field(model.position), 3)
    result = weights(interpolation.scattered(model), place, values.size) @ values
    np.testing.assert_allclose(result[:, 2], field(place), atol=5e-3)


def test_the_error_falls_with_the_third_power_of_the_spacing():
    error = []
    for count in (12, 24):
        model, place = cloud(2, count, seed=4)
        values = np.repeat(np.sin(4 * model.position.sum(axis=1)), 3)
        result = weights(interpolation.scattered(model), place, values.size)[:, 0] @ values
        error.append(np.sqrt(np.mean((result - np.sin(4 * place.sum(axis=1))) ** 2)))
    assert np.log2(error[0] / error[1]) > 2.3


def test_a_plate_is_read_nearly_as_by_its_elements(shared_data):
    plate = handed_over(shared_data, "plate")
    place = np.random.default_rng(2).uniform([0, 0, 0], [0.4, 0.3, 0], (100, 3))
    size = len(plate.dof)
    exact = weights(interpolation.plate(plate, plate.elements), place, size)[:, 0] @ plate.shape
    scattered = weights(interpolation.scattered(plate), place, size)[:, 0] @ plate.shape
    nearest = weights(interpolation.nearest(plate), place, size)[:, 0] @ plate.shape
    scale = np.sqrt(np.mean(exact**2, axis=0))[:10]
    error, coarse = (
        np.sqrt(np.mean((shapes - exact) ** 2, axis=0))[:10] for shapes in (scattered, nearest)
    )
    assert (error < 0.02 * scale).all()
    assert (coarse > 5 * error).all()


def test_slopes_are_continuous_and_those_of_finite_differences():
    """Along a path that passes from the neighbourhood of one node to that of the next."""
    model, _ = cloud(2, 7, seed=3)
    share = np.linspace(0, 1, 2001)[:, None]
    path = (1 - share) * model.position[8] + share * model.position[40]
    tree = KDTree(model.position)
    assert len(np.unique(tree.query(path)[1])) > 3
    read = interpolation.scattered(model)
    values = np.random.default_rng(5).normal(size=len(model.dof))
    value = weights(read, path, len(model.dof))[:, 0] @ values
    slope = (slopes(read, path, len(model.dof))[:, 0] @ values) @ (path[-1] - path[0])
    step = share[1, 0] - share[0, 0]
    along = slope / np.ptp(share)
    scale = np.abs(along).max()
    np.testing.assert_allclose(
        np.diff(value) / step, (along[1:] + along[:-1]) / 2, atol=1e-4 * scale
    )
    assert np.abs(np.diff(along)).max() < 0.02 * scale


def test_moving_the_coordinate_system_changes_nothing():
    model, place = cloud(3, 5)
    turned, shift = Rotation.random(rng=9).as_matrix(), np.array([2.0, -1.0, 5.0])
    moved = nodes(model.position @ turned + shift, (1, 2, 3))
    weight = weights(interpolation.scattered(moved), place @ turned + shift, len(model.dof))
    expected = weights(interpolation.scattered(model), place, len(model.dof))
    np.testing.assert_allclose(weight, expected, atol=1e-7)


def test_the_nearest_node_is_read():
    model, place = cloud(3, 5)
    read = interpolation.nearest(model)
    node = KDTree(model.position).query(place)[1]
    weight = weights(read, place, len(model.dof))
    expected = np.eye(len(model.dof)).reshape(-1, 3, len(model.dof))[node]
    np.testing.assert_array_equal(weight, expected)
    np.testing.assert_array_equal(closest(read, place), model.position[node])


def test_far_from_all_nodes_the_edge_of_their_reach_is_read():
    model, _ = cloud(2, 6)
    read = interpolation.scattered(model)
    far = model.position.mean(axis=0) + np.array([[100.0, 0, 0], [0, 0, 100.0]])
    weight = weights(read, far, len(model.dof))
    np.testing.assert_allclose(weight.sum(axis=2), 1, atol=1e-6)
    drawn = closest(read, far)
    assert (KDTree(model.position).query(drawn)[0] < 1).all()
    np.testing.assert_allclose(weight, weights(read, drawn, len(model.dof)), atol=1e-7)
    inside = model.position[:5] + 1e-3
    np.testing.assert_allclose(closest(read, inside), inside, atol=1e-15)


@pytest.mark.parametrize("read", [interpolation.scattered, interpolation.nearest])
def test_near_reads_the_same_with_less(read):
    model, _ = cloud(2, 20)
    reading, size = read(model), len(model.dof)
    centre = model.position[[45, 300]] + 0.01
    part = reading.near(centre, 0.05)
    rng = np.random.default_rng(8)
    place = np.repeat(centre, 20, axis=0) + rng.uniform(-0.028, 0.028, (40, 3))
    np.testing.assert_array_equal(weights(part, place, size), weights(reading, place, size))
    assert len(part.rows) < len(reading.rows) / 5
    rows = part.used_rows()
    small = weights(part.renumbered(rows), place, len(rows))
    np.testing.assert_array_equal(small, weights(reading, place, size)[..., rows])


def test_only_nodes_that_have_all_axes_are_read():
    model = nodes([[0, 0, 0], [1, 0, 0], [2, 0, 0]], (1, 3))
    model.dof = model.dof[1:]  # the first node has lost x
    place = np.array([[0.1, 0.0, 0.0]])
    np.testing.assert_array_equal(
        weights(interpolation.nearest(model), place, 5), np.eye(5)[None, 1:3]
    )
    np.testing.assert_array_equal(
        weights(interpolation.nearest(model, axes=(3,)), place, 5), np.eye(5)[None, :1]
    )


@pytest.mark.parametrize("read", [interpolation.scattered, interpolation.nearest])
def test_axes_that_no_node_has_are_refused(read):
    model = nodes([[0, 0, 0], [1, 0, 0]], (3, 4))
    with pytest.raises(ValueError, match=r"axes=\(4,\): the motion is read along"):
        read(model, axes=(4,))
    with pytest.raises(ValueError, match=r"along all of the axes \(1, 3\)"):
        read(model, axes=(1, 3))
    with pytest.raises(ValueError, match=r"have the directions \[4, 5\]"):
        read(nodes([[0, 0, 0], [1, 0, 0]], (4, 5)))


@pytest.mark.parametrize("position", [[[0, 0, 0]], 4 * [[1, 0, 0]]], ids=["one", "all alike"])
def test_nodes_at_one_place_are_refused(position):
    with pytest.raises(ValueError, match=r"interpolation\.nearest\(model\)"):
        interpolation.scattered(nodes(position, (1, 2, 3)))


def test_equations_are_solved_as_by_lapack():
    random = np.random.default_rng(3)
    axes = np.linalg.qr(random.normal(size=(10, 10)))[0]
    matrix = axes * np.logspace(-7, 1, 10) @ axes.T
    right = random.normal(size=10)
    solution = _solution(jnp.asarray(matrix), right)
    # Backward stable: the residual is that of rounding, whatever the condition.
    scale = np.linalg.norm(matrix) * np.linalg.norm(solution)
    assert np.linalg.norm(matrix @ solution - right) < 1e-14 * scale


def test_a_batch_of_readings_calls_no_lapack():
    # Calls for several transducers at once can wait for each other forever.
    model, place = cloud(2, 5)
    read = interpolation.scattered(model)
    program = jax.jit(jax.vmap(lambda position: read.at(position).weight))
    text = program.lower(jnp.asarray(place)).as_text()
    assert "stablehlo.divide" in text
    assert "lapack" not in text
