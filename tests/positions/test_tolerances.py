"""Uniform positions within tolerances, clipped to the structure; nearest nodes."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import positions
from bayes_placement._shared.sites import is_unknown
from bayes_placement.positions import _nearest_nodes

FRAME = ((0.0, 0.0, 0.0), (1.2, 0.0, 0.9))
"""Bounds of a frame in the plane y = 0."""

BODY = ((0.0, 0.0, 0.0), (1.0, 0.8, 0.6))


def limits(segment, bounds=(0.0, 1.0)):
    distribution = segment.on(bounds)
    assert isinstance(distribution, dist.Uniform)
    return float(distribution.low), float(distribution.high)


def test_a_segment_is_uniform_to_both_sides():
    np.testing.assert_allclose(limits(positions.Segment(0.25, within=0.04)), (0.21, 0.29))


@pytest.mark.parametrize(
    ("centre", "within", "expected"),
    [(0.01, 0.04, (0.0, 0.05)), (0.98, 0.04, (0.94, 1.0)), (1.02, 0.04, (0.98, 1.0))],
)
def test_a_segment_is_clipped_to_the_structure(centre, within, expected):
    np.testing.assert_allclose(limits(positions.Segment(centre, within=within)), expected)


@pytest.mark.parametrize(
    ("tolerance", "bounds", "example"),
    [
        (positions.Segment(0.25, within=20), (0.0, 1.0), "0.02 for 20 mm"),
        (positions.Box((0.3, 0.0, 0.2), within=(5, 0, 0)), FRAME, "0.005 for 5 mm"),
        (positions.Member(*FRAME, centre=(0.4, 0.0, 0.3), within=30), FRAME, "0.03 for 30 mm"),
        (
            positions.Patch((0.3, 0.0, 0.2), (1, 0, 0), (0, 0, 1), within=(0.1, 10)),
            FRAME,
            "0.01 for 10 mm",
        ),
        (positions.Ball((0.3, 0.2, 0.2), 8), BODY, "0.008 for 8 mm"),
    ],
)
def test_a_tolerance_larger_than_the_structure_is_refused(tolerance, bounds, example):
    with pytest.raises(ValueError, match=rf"a tolerance in metres is needed: {example}"):
        tolerance.on(bounds)


def test_a_tolerance_as_long_as_the_structure_is_a_tolerance():
    assert limits(positions.Segment(0.25, within=1.0)) == (0.0, 1.0)


@pytest.mark.parametrize("centre", [1.3, -0.3, 1.04])
def test_a_segment_beside_the_structure_is_refused(centre):
    with pytest.raises(ValueError, match=r"has no point on the structure \(0 to 1 m\)"):
        positions.Segment(centre, within=0.04).on((0.0, 1.0))


@pytest.mark.parametrize("within", [0.0, -0.01, float("nan")])
def test_a_tolerance_must_be_positive(within):
    with pytest.raises(ValueError, match=r"a positive tolerance \[m\] is needed.*at=0.5"):
        positions.Segment(0.5, within=within)


def ends(place):
    """Ends of each uniform distribution of a place, by name, and its other coordinates."""
    coordinates = place.frame().values
    return {
        name: (float(coordinate.low), float(coordinate.high))
        if is_unknown(coordinate)
        else coordinate
        for name, coordinate in coordinates.items()
    }


@pytest.mark.parametrize(
    ("centre", "within", "expected"),
    [
        ((0.73, 0.0, 0.9), (0.02, 0.0, 0.0), {"x": (0.71, 0.75), "y": 0.0, "z": 0.9}),
        ((0.01, 0.0, 0.89), (0.02, 0.0, 0.03), {"x": (0.0, 0.03), "y": 0.0, "z": (0.86, 0.9)}),
        # No room along y, whatever the tolerance.
        ((0.5, 0.01, 0.9), (0.02, 0.05, 0.0), {"x": (0.48, 0.52), "y": 0.0, "z": 0.9}),
        # Six digits of a universal file are not quite on the structure.
        ((0.5, 0.0, 0.9 + 1e-10), (0.02, 0.0, 0.0), {"x": (0.48, 0.52), "y": 0.0, "z": 0.9}),
    ],
)
def test_a_box_is_clipped_along_each_axis(centre, within, expected):
    ranges = ends(positions.Box(centre, within=within).on(FRAME))
    for name, value in expected.items():
        np.testing.assert_allclose(ranges[name], value, atol=1e-9)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, (0.0, 0.9)),
        ({"centre": (1.2, 0.0, 0.53), "within": 0.02}, (0.35, 0.39)),
        ({"centre": (1.23, 0.0, 0.01), "within": 0.04}, (0.85, 0.9)),
    ],
)
def test_a_member_is_clipped_to_its_ends(options, expected):
    place = positions.Member((1.2, 0.0, 0.9), (1.2, 0.0, 0.0), **options).on(FRAME)
    assert place.start == (1.2, 0.0, 0.9)
    assert place.direction == (0.0, 0.0, -1.0)
    np.testing.assert_allclose(ends(place)["along"], expected)


def test_a_member_is_clipped_to_the_structure():
    place = positions.Member((-0.3, 0.0, -0.4), (0.9, 0.0, 1.2)).on(FRAME)
    np.testing.assert_allclose(ends(place)["along"], (0.5, 1.625))


@pytest.mark.parametrize(
    ("centre", "first", "second", "expected"),
    [
        ((0.1, 0.0, 0.8), (2, 0, 0), (0, 0, -1), {"first": (-0.1, 0.3), "second": (-0.1, 0.2)}),
        ((0.6, 0.0, 0.4), (3, 0, 4), (4, 0, -3), {"first": (-0.3, 0.3), "second": (-0.2, 0.2)}),
    ],
)
def test_a_patch_is_clipped_along_its_directions(centre, first, second, expected):
    place = positions.Patch(centre, first, second, within=(0.3, 0.2)).on(FRAME)
    ranges = ends(place)
    for name, value in expected.items():
        np.testing.assert_allclose(ranges[name], value, atol=1e-12)


def test_a_patch_that_the_edge_cuts_obliquely_is_refused():
    oblique = positions.Patch((0.1, 0.0, 0.4), (3, 0, 4), (4, 0, -3), within=(0.3, 0.2))
    with pytest.raises(ValueError, match="what is left of it is empty or no rectangle"):
        oblique.on(FRAME)


def test_a_ball_has_a_share_for_each_axis_with_room():
    assert len(positions.Ball((0.5, 0.4, 0.3), 0.1).on(BODY).share) == 3
    place = positions.Ball((0.5, 0.003, 0.9), 0.005).on(FRAME)
    assert len(place.share) == 2
    np.testing.assert_allclose(place.cut.radius, 0.004)


@pytest.mark.parametrize(
    "support",
    [
        positions.Box((1.5, 0.0, 0.5), within=(0.1, 0.0, 0.0)),
        positions.Box((0.5, 0.2, 0.5), within=(0.1, 0.0, 0.0)),
        positions.Member((1.3, 0.0, 0.0), (1.3, 0.0, 0.9)),
        positions.Member((0.0, 0.1, 0.0), (0.0, 0.1, 0.9)),
        positions.Member((0.0, 0.0, 1.0), (0.0, 0.0, 2.0)),
        positions.Patch((0.5, 0.0, 1.2), (1, 0, 0), (0, 0, 1), within=(0.1, 0.1)),
        positions.Patch((0.5, 0.1, 0.5), (1, 0, 0), (0, 0, 1), within=(0.1, 0.1)),
        positions.Ball((0.5, 0.1, 0.5), 0.05),
        positions.Nodes([[0.5, 0.1, 0.5]]),
    ],
)
def test_a_support_beside_the_structure_is_refused(support):
    box = r"\(0, 0, 0\) to \(1.2, 0, 0.9\) m"
    with pytest.raises(ValueError, match=box):
        support.on(FRAME)


@pytest.mark.parametrize(
    "support",
    [
        positions.Box((0.5, 0.0, 0.5), within=(0.1, 0.0, 0.0)),
        positions.Member((0.3, 0.0, 0.0), (0.3, 0.0, 0.9)),
        positions.Patch((0.5, 0.0, 0.5), (1, 0, 0), (0, 0, 1), within=(0.1, 0.1)),
        positions.Ball((0.5, 0.1, 0.5), 0.2),
        positions.Nodes([[0.5, 0.1, 0.5]]),
    ],
    ids=lambda support: type(support).__name__,
)
def test_three_coordinates_on_a_line_are_refused(support):
    with pytest.raises(ValueError, match=r"is a line \(0 to 1 m\).* at=0.5, or at=positions.Segm"):
        support.on((0.0, 1.0))


@pytest.mark.parametrize("support", [positions.Segment(0.5, within=0.1), positions.Nodes([0.5])])
def test_one_coordinate_in_space_is_refused(support):
    with pytest.raises(
        ValueError, match=r"lies in space .*positions.Box\(\(0.6, 0, 0.45\), within"
    ):
        support.on(FRAME)


def test_a_support_keeps_what_was_recorded():
    nodes = np.array([[0.0, 0.0, 0.0], [0.2, 0.4, 0.2]])
    centre = (0.5, 0.0, 0.5)
    for support in (
        positions.Box(centre, within=(0.1, 0.0, 0.0)),
        positions.Member((0.5, 0, 0), (0.5, 0, 0.9), centre=centre, within=0.1),
        positions.Patch(centre, (1, 0, 0), (0, 0, 1), within=(0.1, 0.1)),
        positions.Ball(centre, 0.1),
        positions.Nodes(nodes, positions.Ball(centre, 0.1)),
    ):
        assert support.recorded == centre
    assert positions.Segment(0.3, within=0.1).recorded == 0.3
    assert positions.Member((0.5, 0, 0), (0.5, 0, 0.8)).recorded == (0.5, 0.0, 0.4)
    assert positions.Nodes(nodes).recorded == (0.1, 0.2, 0.1)
    assert positions.Nodes([0.2, 0.6]).recorded == pytest.approx(0.4)


WRONG = [
    (lambda: positions.Box((0, 0), within=(1, 1, 1)), r"Box\(centre=...\) was given"),
    (lambda: positions.Box((0, 0, 0), within=(0, 0, 0)), r"not all zero .* at=\(0.0, 0.0, 0.0\)"),
    (lambda: positions.Box((0, 0, 0), within=(0.1, -0.1, 0)), "that are not negative"),
    (lambda: positions.Member((0, 0, 0), (0, 0, 0)), r"end - start\) was given"),
    (
        lambda: positions.Member((0, 0, 0), (1, 0, 0), within=0.1),
        "or neither for the entire member",
    ),
    (
        lambda: positions.Member((0, 0, 0), (1, 0, 0), centre=(0.5, 0, 0), within=0),
        "a positive tolerance",
    ),
    (
        lambda: positions.Member((0, 0, 0), (1, 0, 0), centre=(0.5, 0.2, 0), within=0.1),
        "lies 0.2 m off the axis",
    ),
    (
        lambda: positions.Patch((0, 0, 0), (1, 0, 0), (0, 1, 0), within=(0.1, 0)),
        "two positive tolerances",
    ),
    (lambda: positions.Ball((0, 0, 0), 0), r"a positive radius \[m\] is needed"),
    (lambda: positions.Nodes(np.zeros((4, 2))), r"three coordinates each in space \(node, 3\)"),
    (lambda: positions.Nodes([]), "at least one node"),
]


@pytest.mark.parametrize(("make", "words"), WRONG)
def test_what_makes_no_support_is_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def weights(place):
    """Weight of each node by its row."""
    return dict(zip(place.row.tolist(), np.asarray(place.node.probs).tolist(), strict=True))


def test_nodes_on_a_line_have_the_stretch_that_is_nearest():
    nodes = positions.Nodes([0.0, 0.1, 0.3, 0.35, 0.7], positions.Segment(0.2, within=0.15))
    place = nodes.on((0.0, 1.0))
    # 0.05 to 0.35 m: half-way points 0.05, 0.2 and 0.325 m.
    expected = {1: 0.15 / 0.3, 2: 0.125 / 0.3, 3: 0.025 / 0.3}
    assert weights(place) == pytest.approx(expected)
    np.testing.assert_array_equal(place.position, [0.1, 0.3, 0.35])
    assert place.weight_error == 0.0


def test_nodes_beside_a_member_have_the_stretch_that_is_nearest():
    nodes = [[0.0, 0.3, 0.1], [0.1, 0.0, 0.5], [0.0, 0.0, 0.85], [0.5, 0.5, 0.5]]
    place = positions.Nodes(nodes, positions.Member((0, 0, 0), (0, 0, 0.6))).on(BODY)
    # |x - z| alike: 0.09 + (z - 0.1)^2 = 0.01 + (z - 0.5)^2, and 0.01 + (z - .5)^2 = (z - .85)^2.
    first = (0.26 - 0.10) / 0.8
    assert weights(place) == pytest.approx({0: first / 0.6, 1: 1 - first / 0.6})


def test_nodes_without_a_support_are_alike():
    place = positions.Nodes([[0.1, 0.1, 0.1], [0.5, 0.5, 0.5], [9.0, 9.0, 9.0]]).on(BODY)
    assert weights(place) == {0: 0.5, 1: 0.5}


def test_a_single_node_is_known():
    place = positions.Nodes([[0.1, 0.1, 0.1], [0.9, 0.5, 0.5]], positions.Ball((0, 0, 0), 0.1))
    assert place.on(BODY).node == 0


@pytest.fixture(scope="module")
def scattered():
    """Nodes off a tilted rectangle, with twins among them, and the rectangle."""
    generator = np.random.default_rng(5)
    nodes = generator.normal(size=(70, 3)) * np.array([0.3, 0.3, 0.1])
    directions = np.linalg.qr(generator.normal(size=(3, 2)))[0].T
    region = _nearest_nodes.Rectangle(
        np.array([0.1, 0.05, 0.02]), directions, np.array([[-0.2, 0.4], [-0.3, 0.1]])
    )
    return nodes, region


def test_cells_in_a_plane_are_where_points_are_nearest(scattered):
    nodes, region = scattered
    shares = _nearest_nodes.shares(nodes, region)
    steps = (np.arange(400) + 0.5) / 400
    grid = np.stack(np.meshgrid(-0.2 + 0.6 * steps, -0.3 + 0.4 * steps), axis=-1).reshape(-1, 2)
    distance = np.linalg.norm(region.at(grid)[:, None] - nodes, axis=-1)
    counted = np.bincount(np.argmin(distance, axis=1), minlength=len(nodes)) / len(grid)
    np.testing.assert_allclose(shares, counted, atol=1e-3)
    np.testing.assert_allclose(np.sum(shares), 1.0, rtol=1e-12)


def test_nodes_that_tie_share_their_cell(scattered):
    nodes, region = scattered
    normal = np.cross(*region.directions)
    height = (nodes - region.origin) @ normal
    mirrored = nodes - 2 * height[:, None] * normal
    single = _nearest_nodes.shares(nodes, region)
    for twins in (nodes, mirrored):
        shares = _nearest_nodes.shares(np.concatenate([nodes, twins]), region)
        np.testing.assert_allclose(shares, np.tile(single / 2, 2), atol=1e-12)


def grid(counts):
    axes = [np.linspace(low, high, n) for low, high, n in zip(*BODY, counts, strict=True)]
    return axes, np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def test_cells_in_space_are_found_by_points_within_their_stated_error():
    axes, nodes = grid((6, 5, 4))
    box = positions.Box((0.33, 0.41, 0.5), within=(0.3, 0.25, 0.2))
    place = positions.Nodes(nodes, box).on(BODY)
    stretches = [
        positions.Nodes(axis, positions.Segment(centre, within=within)).on((axis[0], axis[-1]))
        for axis, centre, within in zip(axes, box.centre, box.within, strict=True)
    ]
    shares = [np.asarray(stretch.node.probs) for stretch in stretches]
    exact = np.einsum("a,b,c->abc", *shares).ravel()
    assert 0 < place.weight_error < 2e-3
    np.testing.assert_allclose(place.node.probs, exact, atol=5 * place.weight_error)


def test_cells_of_a_cut_ball_are_where_uniform_points_are_nearest():
    _, nodes = grid((6, 5, 4))
    centre, radius = np.array([0.2, 0.35, 0.5]), 0.3
    place = positions.Nodes(nodes, positions.Ball(centre, radius)).on(BODY)
    points = np.random.default_rng(2).uniform(*BODY, (400_000, 3))
    points = points[np.linalg.norm(points - centre, axis=1) < radius]
    distance = np.linalg.norm(points[:, None] - nodes, axis=-1)
    counted = np.bincount(np.argmin(distance, axis=1), minlength=len(nodes)) / len(points)
    error = np.sqrt(counted * (1 - counted) / len(points)) + place.weight_error
    shares = np.zeros(len(nodes))
    shares[place.row] = place.node.probs
    np.testing.assert_array_less(np.abs(shares - counted), 5 * error + 1e-9)


SCALED = [
    (bp.positions.Segment(0.3, within=0.02), 0.04),
    (bp.positions.Nodes(np.array([0.1, 0.3]), bp.positions.Segment(0.3, within=0.02)), 0.04),
    (bp.positions.Box((1, 2, 3), within=(0.02, 0.0, 0.01)), (0.04, 0.0, 0.02)),
    (bp.positions.Member((0, 0, 0), (0, 0, 1), centre=(0, 0, 0.3), within=0.02), 0.04),
    (bp.positions.Patch((1, 2, 3), (1, 0, 0), (0, 1, 0), within=(0.02, 0.01)), (0.04, 0.02)),
    (bp.positions.Ball((1, 2, 3), 0.02), 0.04),
]


@pytest.mark.parametrize(("support", "wanted"), SCALED)
def test_a_tolerance_twice_as_large_is_about_the_same_place(support, wanted):
    scaled = support.scaled(2.0)
    inner = scaled.tolerance if isinstance(scaled, bp.positions.Nodes) else scaled
    within = inner.radius if isinstance(inner, bp.positions.Ball) else inner.within
    assert within == pytest.approx(wanted)
    assert scaled.recorded == support.recorded


@pytest.mark.parametrize(
    ("support", "message"),
    [
        (bp.positions.Nodes(np.array([0.1, 0.3])), r"Nodes without a tolerance .* Give them"),
        (
            bp.positions.Member((0, 0, 0), (0, 0, 1)),
            r"A positions.Member without `within` .* Give a recorded",
        ),
    ],
)
def test_what_has_no_tolerance_cannot_have_another(support, message):
    with pytest.raises(ValueError, match=message):
        support.scaled(2.0)
