"""Coordinates in space from numbers and distributions, and uniform positions in a cut ball."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy import stats

from bayes_placement._shared.sites import substitute, unknowns
from bayes_placement.positions import _ball_in_box, places

UNKNOWN = dist.Uniform(0.1, 0.3)
TILTED = (0.6, 0.0, 0.8)
BOX = ((-0.3, -2.0, -0.1), (0.9, 0.5, 0.7))
"""Cuts the unit ball about the origin on five sides of six, none like another."""


def cut_ball(*share, bounds=BOX, centre=(0.0, 0.0, 0.0), radius=1.0):
    return places.InBall(share, centre, radius, bounds)


EXAMPLES = [
    (places.Cartesian(UNKNOWN, 0.5, UNKNOWN), {"x": 0.2, "z": 0.25}, (0.2, 0.5, 0.25), "m"),
    (
        places.OnMember(UNKNOWN, start=(1.0, 0.0, 0.5), direction=(3.0, 0.0, 4.0)),
        {"along": 0.2},
        (1.12, 0.0, 0.66),
        "m",
    ),
    (
        places.OnPatch(UNKNOWN, UNKNOWN, origin=(1, 0, 0), directions=[TILTED, (0, -2, 0)]),
        {"first": 0.3, "second": 0.1},
        (1.18, -0.1, 0.24),
        "m",
    ),
    (
        cut_ball(UNKNOWN, bounds=((0.5, -1.0, -1.0), (0.5, -1.0, 1.0)), centre=(0.5, -1.0, 0.2)),
        {"share.1": 0.25},
        (0.5, -1.0, -0.8 + 0.25 * 1.8),
        "1",
    ),
    (
        places.AtNode(
            dist.Categorical(probs=np.array([0.5, 0.2, 0.3])),
            np.arange(9.0).reshape(3, 3),
            np.array([4, 7, 8]),
        ),
        {"node": 2},
        (6.0, 7.0, 8.0),
        "1",
    ),
]
NAMES = [type(place).__name__ for place, *_ in EXAMPLES]


@pytest.mark.parametrize(("place", "values", "expected", "unit"), EXAMPLES, ids=NAMES)
def test_unknowns_are_named_by_their_path_and_give_coordinates(place, values, expected, unit):
    named = {unknown.name: unknown.unit for unknown in unknowns({"position": place})}
    assert named == {f"position.{name}": unit for name in values}
    coordinates = jax.jit(lambda: substitute(place, values).coordinates())()
    np.testing.assert_allclose(coordinates, expected, rtol=1e-12)


@pytest.mark.parametrize(("place", "values", "position", "unit"), EXAMPLES, ids=NAMES)
def test_the_nearest_values_lead_back_to_a_position(place, values, position, unit):
    nearest = place.nearest(position)
    assert nearest.keys() == values.keys()
    np.testing.assert_allclose(list(nearest.values()), list(values.values()), rtol=1e-9)


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        (EXAMPLES[0][0], (0.2, 0.5, 0.2)),
        (EXAMPLES[1][0], (1.12, 0.0, 0.66)),
        (EXAMPLES[2][0], (1.12, -0.2, 0.16)),
        (cut_ball(centre=(0.0, 0.6, 0.8)), (0.0, 0.5, 0.7)),
        (EXAMPLES[4][0], (2.4, 3.4, 4.4)),
        (places.AtNode(2, np.arange(3.0), np.arange(3)), 2.0),
    ],
)
def test_the_middle_is_the_mean_of_the_distributions(place, expected):
    np.testing.assert_allclose(place.middle(), expected, rtol=1e-12)


def test_a_position_beside_a_place_goes_to_the_next_of_it():
    member = places.OnMember(UNKNOWN, start=(1.0, 0.0, 0.5), direction=TILTED)
    np.testing.assert_allclose(member.nearest((9.0, 3.0, 9.0))["along"], 0.3)
    nearest = places.Cartesian(UNKNOWN, dist.Normal(0.0, 1.0), 0.2).nearest((-4.0, 5.0, 0.0))
    assert {name: float(value) for name, value in nearest.items()} == {"x": 0.1, "y": 5.0}
    ball = cut_ball(UNKNOWN, UNKNOWN, UNKNOWN)
    shares = {int(name[-1]): value for name, value in ball.nearest((5.0, -0.2, 0.1)).items()}
    place = jax.jit(lambda: cut_ball(*(shares[i] for i in (1, 2, 3))).coordinates())()
    np.testing.assert_allclose(place[0], 0.9)
    assert np.linalg.norm(place) <= 1.0


def test_a_position_on_a_line_is_a_number_without_axes():
    assert places.coordinates(0.3).shape == ()
    node = places.AtNode(1, np.array([0.2, 0.4]), np.array([5, 6]))
    assert float(places.coordinates(node)) == 0.4
    assert places.coordinates((0.1, jnp.asarray(0.2), 3)).shape == (3,)


def test_a_distribution_of_labels_has_its_most_probable_value_as_the_typical_one():
    assert places.typical(dist.Categorical(probs=np.array([0.2, 0.5, 0.3]))) == 1
    assert places.typical(UNKNOWN) == pytest.approx(0.2)


BALLS = [
    _ball_in_box.Cut(1.0, *BOX),
    _ball_in_box.Cut(1.0, (0.3, 0.4, -0.1), (0.9, 2.0, 0.7)),
    _ball_in_box.Cut(0.5, (0.1, -0.05), (1.0, 0.2)),
]


def volume(cut):
    """Volume of a cut ball: midpoints of all but the last axis, times the width there."""
    low, high = cut.box()
    steps = (np.arange(1000) + 0.5) / 1000
    axes = [start + (stop - start) * steps for start, stop in zip(low[:-1], high[:-1], strict=True)]
    square = sum(coordinate**2 for coordinate in np.meshgrid(*axes, sparse=True))
    half = np.sqrt(np.maximum(cut.radius**2 - square, 0.0))
    width = np.maximum(np.minimum(cut.high[-1], half) - np.maximum(cut.low[-1], -half), 0.0)
    return np.mean(width) * np.prod(high[:-1] - low[:-1])


@pytest.mark.parametrize(
    "cut",
    [
        BALLS[1],
        *(pytest.param(BALLS[n], marks=[pytest.mark.long, pytest.mark.longest]) for n in (0, 2)),
    ],
)
def test_equal_shares_have_equal_volumes(cut):
    # A map of the unit cube onto the cut ball, one to one, whose Jacobian is the same everywhere.
    share = np.random.default_rng(3).random((400, len(cut.low)))

    def at(vector):
        return jnp.stack(_ball_in_box.point(cut, vector))

    place, slopes = jax.jit(jax.vmap(lambda vector: (at(vector), jax.jacobian(at)(vector))))(share)
    determinant = np.linalg.det(slopes)
    np.testing.assert_allclose(determinant, np.mean(determinant), rtol=1e-8)
    np.testing.assert_allclose(np.mean(determinant), volume(cut), rtol=1e-4)
    back = jax.jit(jax.vmap(lambda point: jnp.stack(_ball_in_box.shares(cut, point))))(place)
    np.testing.assert_allclose(back, share, atol=1e-9)


def test_samples_of_a_cut_ball_are_uniform_in_it():
    generator = np.random.default_rng(8)
    distributions = tuple(dist.Uniform(0.0, 1.0) for _ in range(3))
    shares = generator.random((20_000, 3))
    low, high = np.array(BOX)
    bounds = ((1.7, -2.0, 3.9), (2.9, 0.5, 4.7))  # the same box about (2, 0, 4)
    ball = cut_ball(*distributions, bounds=bounds, centre=(2.0, 0.0, 4.0))

    def coordinates(share):
        values = {f"share.{number}": value for number, value in enumerate(share, start=1)}
        return substitute(ball, values).coordinates()

    drawn = np.asarray(jax.jit(jax.vmap(coordinates))(shares)) - np.array([2.0, 0.0, 4.0])
    thrown = generator.uniform(np.maximum(low, -1), np.minimum(high, 1), (80_000, 3))
    in_ball = thrown[np.sum(thrown**2, axis=1) < 1]
    assert np.all(np.sum(drawn**2, axis=1) <= 1 + 1e-9)
    for direction in (*np.eye(3), np.array([1.0, 2.0, -1.5]), np.array([1.0, -1.0, 0.5])):
        assert stats.ks_2samp(drawn @ direction, in_ball @ direction).pvalue > 1e-4


def test_gradients_stay_finite_to_the_rim():
    edge = np.array(list(itertools.product([1e-12, 0.5, 1 - 1e-12], repeat=3)))
    slopes = jax.jacobian(lambda vector: jnp.stack(_ball_in_box.point(BALLS[0], vector)))
    assert np.all(np.isfinite(jax.jit(jax.vmap(slopes))(edge)))


@pytest.mark.parametrize("values", [(0.1, 0.2), (0.1, 0.2, float("nan")), 0.3])
def test_a_vector_has_three_finite_numbers(values):
    with pytest.raises(ValueError, match="three finite numbers along x, y and z"):
        places.OnMember(UNKNOWN, start=np.atleast_1d(values), direction=(0, 0, 1))


def test_a_direction_has_a_length():
    with pytest.raises(ValueError, match="no direction; a vector other than zero is needed"):
        places.OnMember(UNKNOWN, start=(0, 0, 0), direction=(0, 0, 0))


def test_directions_of_a_patch_are_at_right_angles():
    with pytest.raises(ValueError, match=r"two at right angles .* second=\(0.0, 1.0, 0.0\)"):
        places.OnPatch(0.0, 0.0, origin=(0, 0, 0), directions=[(1, 0, 0), (1, 1, 0)])
