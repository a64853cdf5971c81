"""Figure of a structure: edges, transducers and scores at their places."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from skfem import Basis, ElementHex1, ElementQuad1, ElementVector, MeshHex, MeshQuad

import bayes_placement as bp
from bayes_placement.modes.finite_elements import interpolation, modes_from_shapes, outline
from bayes_placement.plots import structure as structure_plots
from tests.in_space import BOUNDS, Linear
from tests.simulator.element_models import nodes

CORNERS = np.array([[0.0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 4]])


def model(position):
    return bp.finite_elements.ModalModel.from_arrays(
        position=position,
        shape=np.random.default_rng(0).normal(size=(len(position), 3, 2)),
        natural_frequency=[30.0, 80.0],
        modal_mass=1.0,
    )


def modes(reading, position=CORNERS):
    """Modes with this interpolation; which rows it reads does not matter here."""
    handed_over = model(np.vstack([position, np.zeros((20, 3))]))
    return modes_from_shapes(handed_over, reading)


def lines(drawn):
    """Set of lines, each the set of its two ends."""
    points, style = drawn
    assert style == "-"
    parts = points.reshape(-1, 3, 3)
    assert np.isnan(parts[:, 2]).all()
    ends = np.round(parts[:, :2], 9) + 0.0
    return {frozenset(map(tuple, pair)) for pair in ends.tolist()}


def pairs(*indices):
    return {frozenset(map(tuple, (CORNERS[i], CORNERS[j]))) for i, j in indices}


def elements(*corners):
    return interpolation.linear(nodes(CORNERS, (1, 2, 3)), np.array(corners))


def boxes(mesh, element):
    axes = tuple(range(1, mesh.dim() + 1))
    return interpolation.scikit_fem(Basis(mesh, ElementVector(element)), axes=axes)


def experiment(structure_modes, at=(0.0, 1.0, 0.0)):
    return bp.Experiment(
        bp.Structure(structure_modes, damping=bp.damping.Modal(0.02)),
        sensors=[bp.Sensor("s1", at=at), bp.Sensor("s2", at=(0.5, 0.0, 0.0))],
        actuators=[bp.Actuator("a1", at=(0.0, 0.0, 0.0))],
        frequency=[20.0, 50.0],
        observe=bp.observe.Complex("acceleration"),
        noise=None,
    )


def test_lines_triangles_and_tetrahedra_are_drawn_by_their_edges():
    segments = modes(elements([0, 1], [0, 3]))
    assert lines(outline.outline(segments)) == pairs((0, 1), (0, 3))
    face = modes(elements([0, 1, 2]))
    assert lines(outline.outline(face)) == pairs((0, 1), (0, 2), (1, 2))
    solid = modes(elements([0, 1, 2, 3]))
    edges = pairs((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
    assert lines(outline.outline(solid)) == edges


@pytest.mark.parametrize(
    ("mesh", "element", "count"),
    [
        (MeshQuad.init_tensor([0.0, 2.0], [0.0, 1.0, 3.0]), ElementQuad1(), 7),
        (MeshHex.init_tensor([0.0, 2.0], [0.0, 1.0], [0.0, 1.0, 3.0]), ElementHex1(), 20),
    ],
    ids=["rectangles", "bricks"],
)
def test_rectangles_and_bricks_have_no_diagonals(mesh, element, count):
    edges = lines(outline.outline(modes(boxes(mesh, element))))
    assert len(edges) == count
    for start, end in edges:
        assert np.count_nonzero(np.subtract(start, end)) == 1


@pytest.mark.parametrize("read", [interpolation.nearest, interpolation.scattered])
def test_nodes_without_elements_are_dots(read):
    position = np.random.default_rng(1).uniform(size=(15, 3))
    handed_over = model(position)
    points, style = outline.outline(modes_from_shapes(handed_over, read(handed_over)))
    assert style == "."
    np.testing.assert_allclose(points, position)


def test_modes_that_do_not_tell_their_nodes_are_a_box():
    edges = lines(outline.outline(Linear()))
    assert len(edges) == 12
    assert {end for line in edges for end in line} >= set(BOUNDS)


def test_of_a_large_mesh_some_lines_are_drawn(monkeypatch):
    monkeypatch.setattr(outline, "MOST_LINES", 4)
    solid = modes(elements([0, 1, 2, 3]))
    assert len(lines(outline.outline(solid))) == 3


@pytest.mark.parametrize(
    ("size", "axes", "projection"),
    [
        ((1.0, 2.0, 3.0), (0, 1, 2), "3d"),
        ((1.0, 0.0, 3.0), (0, 2), None),
        ((1.0, 2.0, 0.0), (0, 1), None),
        ((2.0, 0.0, 0.0), (0, 2), None),
        ((0.0, 2.0, 0.0), (0, 1), None),
        ((0.0, 0.0, 2.0), (0, 2), None),
        ((0.0, 0.0, 0.0), (0, 2), None),
    ],
)
def test_what_lies_in_a_plane_is_seen_in_that_plane(size, axes, projection):
    corners = np.array([np.ones(3), 1 + np.array(size)])
    shown = structure_plots.view(corners)
    assert (shown.axes, shown.projection) == (axes, projection)
    assert np.all(shown.low < corners[0])
    assert np.all(shown.high > corners[1])
    np.testing.assert_array_equal(shown.project(corners), corners[:, list(axes)].T)


@pytest.fixture(scope="module")
def frame():
    """Draw an L in the plane of x and z, and what is known of three places on it."""
    bars = experiment(modes(elements([0, 1], [0, 3]), CORNERS[[0, 1, 3]]), at=(0.0, 0.0, 3.0))
    rows = pd.DataFrame(
        {
            "x": [0.0, 0.0, 1.0, 2.0],
            "y": 0.0,
            "z": [1.0, 1.0, 0.0, 0.0],
            "size": [2.0, 7.0, 9.0, 4.0],
        }
    )
    figure = Figure()
    axis = figure.subplots()
    shown = structure_plots.view(structure_plots.extent(bars, rows))
    structure_plots.draw_structure(axis, shown, bars)
    structure_plots.draw_scores(axis, shown, rows, "score [1]")
    structure_plots.mark_place(axis, shown, (1.5, 0.0, 0.0))
    structure_plots.name_axes(axis, shown)
    figure.draw_without_rendering()
    return axis


def marked(axis, label):
    (line,) = [curve for curve in axis.lines if curve.get_label() == label]
    return np.transpose(line.get_data()).tolist()


def test_a_place_has_the_colour_of_its_greatest_score(frame):
    (marks,) = frame.collections
    pairs = zip(marks.get_offsets().tolist(), marks.get_array(), strict=True)
    scores = {tuple(at): score for at, score in pairs}
    assert scores == {(0.0, 1.0): 7.0, (1.0, 0.0): 9.0, (2.0, 0.0): 4.0}
    assert (marks.norm.vmin, marks.norm.vmax) == (0.0, 9.0)
    assert marked(frame, "greatest of these places") == [[1.0, 0.0]]


def test_instruments_and_what_was_fitted_are_marked_where_they_are(frame):
    assert marked(frame, "sensor as recorded") == [[0.0, 3.0], [0.5, 0.0]]
    assert marked(frame, "actuator as recorded") == [[0.0, 0.0]]
    assert marked(frame, "place as fitted") == [[1.5, 0.0]]
    names = {text.get_text(): tuple(text.xy) for text in frame.texts}
    assert names == {"s1": (0.0, 3.0), "s2": (0.5, 0.0), "a1": (0.0, 0.0)}


def test_axes_bear_the_names_of_their_coordinates_and_one_scale(frame):
    assert (frame.get_xlabel(), frame.get_ylabel()) == ("x [m]", "z [m]")
    assert frame.get_aspect() == 1.0


def test_places_of_an_unknown_structure_are_all_there_is():
    rows = pd.DataFrame({"x": [0.0, 1.0], "y": [2.0, 3.0], "z": [4.0, 5.0], "size": 1.0})
    np.testing.assert_array_equal(structure_plots.extent(None, rows), [[0, 2, 4], [1, 3, 5]])


def instruments(structure_modes, sensors, actuators):
    return bp.Experiment(
        bp.Structure(structure_modes, damping=bp.damping.Modal(0.02)),
        sensors=sensors,
        actuators=actuators,
        frequency=[20.0],
        observe=bp.observe.Complex("acceleration"),
        noise=None,
    )


def tolerances(axes):
    """Points of all tolerances, without the gaps between their lines."""
    drawn = [line for line in axes.lines if line.get_label() == "tolerance"]
    points = [
        np.transpose(line.get_data_3d() if axes.name == "3d" else line.get_data()) for line in drawn
    ]
    return [part[~np.isnan(part[:, 0])] for part in points]


def texts(axes):
    return [text.get_text() for text in axes.texts]


def legend(figure):
    return {text.get_text() for text in figure.legends[0].get_texts()}


def test_tolerances_and_axes_in_space_are_drawn():
    positions = bp.positions
    box = positions.Box((0.3, 0.3, 0.2), within=(0.1, 0.05, 0.0))
    strut = positions.Member((0.0, 0.8, 0.0), (0.0, 0.8, 0.6), centre=(0.0, 0.8, 0.5), within=0.2)
    ball = positions.Ball((0.9, 0.4, 0.3), radius=0.2)
    placed = [
        bp.Sensor("box", at=box, directions=(1, -3)),
        bp.Sensor("strut", at=strut, directions=(2,)),
        bp.Sensor("ball", at=ball, directions=(3,)),
    ]
    driven = [bp.Actuator("a1", at=(0.9, 0.1, 0.5), directions=(-1,))]
    figure = bp.plots.experiment(instruments(Linear(), placed, driven))
    figure.draw_without_rendering()
    (axes,) = figure.axes
    of_box, of_strut, of_ball = tolerances(axes)
    corners = {(x, y, 0.2) for x in (0.2, 0.4) for y in (0.25, 0.35)}
    assert {tuple(point) for point in of_box.round(9)} == corners and len(of_box) == 8
    np.testing.assert_allclose(of_strut, [[0.0, 0.8, 0.3], [0.0, 0.8, 0.6]])  # cut at its end
    assert of_ball[:, 0].max() == 1.0  # cut where the structure ends
    assert of_ball.min(axis=0) == pytest.approx([0.7, 0.2, 0.1])
    shafts = [np.array(arrow._segments3d[0])[::-1] for arrow in axes.collections]
    np.testing.assert_allclose([tail for tail, _ in shafts][2:4], [strut.recorded, ball.recorded])
    towards = [np.sign(np.round(head - tail, 9)).tolist() for tail, head in shafts]
    assert towards == [[1, 0, 0], [0, 0, -1], [0, 1, 0], [0, 0, 1], [-1, 0, 0]]
    assert [text for text in texts(axes) if text[0] in "+-"] == ["+x", "-z", "+y", "+z", "-x"]
    assert {"tolerance", "measuring axis", "driving axis"} < legend(figure)


@pytest.mark.parametrize(("size", "direction"), [((1.0, 0.8, 0.0), 3), ((1.0, 0.0, 0.6), -2)])
def test_an_axis_out_of_the_plane_points_to_the_reader_or_away(size, direction):
    flat = Linear(box=((0.0, 0.0, 0.0), size))
    placed = [
        bp.Sensor("s1", at=(0.2, 0.0, 0.0), directions=(direction,)),
        bp.Sensor("s2", at=(0.5, 0.0, 0.0), directions=(-direction, 1)),
    ]
    figure = bp.plots.experiment(
        instruments(flat, placed, [bp.Actuator("a1", at=(0.9, 0.0, 0.0), directions=(1,))])
    )
    (axes,) = figure.axes
    marks = {
        line.get_label(): line.get_xdata()[0] for line in axes.lines if "reader" in line.get_label()
    }
    assert marks == {"axis towards the reader": 0.2, "axis away from the reader": 0.5}
    heads = [text.xyann for text in axes.texts if text.get_text() == "+x"]
    assert all(head[0] > 0.5 for head in heads) and len(heads) == 2
    assert "axis towards the reader" in legend(figure)


def test_tolerances_and_axes_on_a_line_are_drawn():
    beam = bp.beams.beam(
        2, length=1.0, area=1e-4, second_moment=1e-9, youngs_modulus=2e11, density=7800.0
    )
    near = bp.positions.Nodes(np.linspace(0.0, 1.0, 11), bp.positions.Segment(0.9, within=0.1))
    placed = [
        bp.Sensor("s1", at=bp.positions.Segment(0.02, within=0.05)),
        bp.Sensor("s2", at=near),
        bp.Sensor("s3", at=0.5),
    ]
    driven = [bp.Actuator("a1", at=0.4, directions=(-3,))]
    figure = bp.plots.experiment(instruments(beam, placed, driven))
    figure.draw_without_rendering()
    (axes,) = figure.axes
    (stretch,) = tolerances(axes)
    np.testing.assert_allclose(stretch, [[0.0, 0.0], [0.07, 0.0]])
    (nodes,) = [line for line in axes.lines if line.get_label().startswith("nodes within")]
    np.testing.assert_allclose(sorted(set(nodes.get_xdata()[::3])), [0.8, 0.9, 1.0])
    upright = {text.get_text(): np.sign(text.xyann) for text in axes.texts if text.arrow_patch}
    assert upright["+z"].tolist() == [0.0, 1.0] and upright["-z"].tolist() == [0.0, -1.0]
    assert {"measuring axis", "driving axis"} < legend(figure)


@pytest.mark.parametrize("size", [(6.4, 5.0), (4.8, 3.6)])
def test_the_name_of_an_axis_of_a_long_structure_covers_none_of_its_numbers(size):
    figure = Figure(figsize=size)
    panel = figure.add_subplot(projection="3d")
    view = structure_plots.view(np.array([[0.0, 0.0, 0.0], [0.4, 0.065, 0.065]]))
    structure_plots.name_axes(panel, view)
    FigureCanvasAgg(figure).draw()  # labels in space have their places once they are drawn
    name = panel.xaxis.label.get_window_extent()
    numbers = [tick.label1.get_window_extent() for tick in panel.xaxis.get_major_ticks()]
    assert len(numbers) > 1 and not any(name.overlaps(number) for number in numbers)


@pytest.mark.parametrize(
    ("size", "axes"),
    [
        ((2.0, 0.1, 0.15), (0, 2)),  # a frame along x
        ((1.0, 0.03, 0.02), (0, 1)),  # a beam whose section is wider than it is high
        ((0.02, 0.03, 1.0), (1, 2)),  # a mast
        ((1.0, 0.8, 0.02), (0, 1)),  # a plate with a thickness
        ((1.0, 0.02, 0.8), (0, 2)),
        ((1.0, 0.2, 0.2), (0, 1, 2)),
    ],
)
def test_a_thin_structure_is_seen_along_its_thinnest_side(size, axes):
    assert structure_plots.view(np.array([np.zeros(3), size])).axes == axes


def test_a_thin_structure_is_drawn_in_axes_in_space_where_they_are_given():
    thin = Linear(box=((0.0, 0.0, 0.0), (2.0, 0.1, 0.15)))
    panel = Figure().add_subplot(projection="3d")
    at = {"sensors": [bp.Sensor("s1", at=(0.2, 0.1, 0.0))]}
    at |= {"actuators": [bp.Actuator("a1", at=(1.0, 0.0, 0.15))]}
    bp.plots.experiment(instruments(thin, **at), ax=panel)
    np.testing.assert_allclose(np.ravel(panel.lines[1].get_data_3d()), (0.2, 0.1, 0.0))


@pytest.mark.parametrize(("direction", "last"), [(2, 0.53), (1, 0.5)])
def test_names_of_instruments_near_each_other_stand_beside_the_last_of_them(direction, last):
    modes = Linear(box=((0.0, 0.0, 0.0), (1.0, 0.6, 0.0)))
    at = {"low": (0.5, 0.3, 0.0), "high": (0.53, 0.3, 0.0)}
    placed = [bp.Sensor(name, at=place, directions=(direction,)) for name, place in at.items()]
    driven = [bp.Actuator("a1", at=(0.1, 0.1, 0.0), directions=(3,))]
    panel, view = Figure().add_subplot(), structure_plots.view(np.array(modes.bounds()))
    structure_plots.draw_structure(panel, view, instruments(modes, placed, driven))
    (names,) = (text for text in panel.texts if text.get_text() == "low\nhigh")
    assert names.xy == pytest.approx((last, 0.3))
