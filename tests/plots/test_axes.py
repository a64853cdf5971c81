"""Every figure function draws in the axes that it is given, and returns their figure."""

import functools
import inspect
import re

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

import bayes_placement as bp
from bayes_placement.plots._plain_figure import PlainFigure
from bayes_placement.plots.report._svg import svg_of
from tests import public_calls
from tests.in_space import Linear
from tests.plots import test_ledger as ledgers
from tests.plots import test_misfit as misfits
from tests.plots import test_placement as maps
from tests.plots import test_posterior as posteriors
from tests.plots import test_structure as structures
from tests.plots.texts import colliding

posterior, misfit, reach = bp.plots.posterior, bp.plots.misfit, bp.plots.reach
ledger, placement, structure = bp.plots.ledger, bp.plots.placement, bp.plots.structure

ONE_PANEL = {
    posterior.pair: lambda: (posteriors.result(),),
    ledger.probabilities: lambda: (ledgers.ranking(),),
    ledger.error_falls: lambda: (ledgers.ledger(),),
    placement.placements: lambda: (maps.placement(5),),
    structure.experiment: lambda: (ledgers.EXPERIMENT,),
}
NEEDED = {posterior.pair: {"first": posteriors.RATIO, "second": posteriors.POSITION}}
"""Settings without a default."""

PANELS = {
    posterior.measured_against_band: (4, lambda: (posteriors.result(),)),
    posterior.response_band: (2, lambda: (posteriors.simulated()[0],)),
    posterior.parameters: (1, lambda: (posteriors.result(),)),
    posterior.intervals: (2, lambda: (posteriors.result(),)),
    posterior.placement: (5, lambda: (posteriors.result_in_space(),)),
    posterior.methods: (1, lambda: ({"one": posteriors.result()},)),
    misfit.residual_map: (2, lambda: (misfits.misfit(levels=2),)),
    misfit.residual_maps: (2, lambda: (ledgers.fits(),)),
    misfit.discrepancy: (2, lambda: (misfits.misfit(),)),
    reach.curves: (4, lambda: (public_calls.reached(),)),
    reach.law: (2, lambda: (public_calls.reached(),)),
    ledger.suspicion: (2, lambda: (ledgers.ranking(),)),
    ledger.before_and_after: (4, lambda: (ledgers.fits(),)),
    placement.information: (3, lambda: (maps.hill("s1", "a1", "s2"),)),
    placement.tolerances: (3, lambda: (maps.study("s1", "a1"),)),
}


@functools.cache
def figure_of(function):
    given = ONE_PANEL[function]() if function in ONE_PANEL else PANELS[function][1]()
    return function(*given, **NEEDED.get(function, {}))


def name(function):
    return f"{function.__module__.rpartition('.')[2]}.{function.__name__}"


@pytest.fixture(autouse=True)
def _without_a_screen():
    matplotlib.use("agg")
    yield
    plt.close("all")


@pytest.mark.parametrize("function", ONE_PANEL, ids=name)
def test_a_figure_of_one_panel_is_drawn_in_the_axes_of_the_caller(function):
    figure, (ours, other) = plt.subplots(1, 2)
    needed = NEEDED.get(function, {})
    assert function(*ONE_PANEL[function](), **needed, ax=ours) is figure
    assert ours.has_data() and not other.has_data()
    assert not figure.legends  # it belongs to the caller; the legend is that of the axes
    figure.draw_without_rendering()


@pytest.mark.parametrize("function", PANELS, ids=name)
def test_a_figure_of_several_panels_is_drawn_in_the_axes_of_the_caller(function):
    count, arguments = PANELS[function]
    figure, axes = plt.subplots(1, count, squeeze=False)
    assert function(*arguments(), axes=axes) is figure
    assert all(axis.has_data() for axis in axes.flat)
    assert not figure.legends
    figure.draw_without_rendering()


@pytest.mark.parametrize("function", PANELS, ids=name)
def test_too_many_axes_are_refused(function):
    count, arguments = PANELS[function]
    figure = Figure()
    axes = figure.subplots(count + 1, 1, squeeze=False)
    with pytest.raises(ValueError, match=f"{count + 1} axes were given; {count} are needed"):
        function(*arguments(), axes=axes)


@pytest.mark.parametrize("function", [*ONE_PANEL, *PANELS], ids=name)
def test_a_figure_fits_a_page_and_its_letters_can_be_read(function):
    svg = svg_of(figure_of(function))
    width = float(re.search(r'viewBox="0 0 ([\d.]+)', svg)[1])  # [pt]
    assert width <= 72 * 180 / 25.4 + 0.1
    sizes = [float(size) for size in re.findall(r"font-size: ?([\d.]+)px", svg)]
    assert sizes and min(sizes) >= 7.0


@pytest.mark.parametrize("function", [*ONE_PANEL, *PANELS], ids=name)
def test_no_text_of_a_figure_covers_another(function):
    assert colliding(figure_of(function)) == ([], [])


@pytest.mark.parametrize("direction", [(1,), (1, 3), (1, 2, 3)])
def test_names_and_axes_of_instruments_at_one_place_stand_apart(direction):
    corners = (0.0, 0.0, 0.0), (1.0, 0.0, 0.6)
    at = {"low": (0.3, 0.0, 0.2), "high": (0.3, 0.0, 0.2), "other": (0.6, 0.0, 0.2)}
    placed = [bp.Sensor(name, at=place, directions=direction) for name, place in at.items()]
    driven = [bp.Actuator("shaker", at=at["low"], directions=(-2,))]
    drawn = structure.experiment(structures.instruments(Linear(box=corners), placed, driven))
    assert colliding(drawn) == ([], [])


def test_long_names_of_axes_are_broken_and_numbers_are_thinned_out():
    figure = PlainFigure.on_page(3.0, 2.0)
    panel = figure.add_subplot()
    panel.set(xlim=(0.0, 0.001), ylabel="a name " * 8, xlabel="a name " * 8)
    panel.set_title("structure.effects.tuned_absorber.damping_ratio")
    assert colliding(figure) == ([], [])
    assert ".\n" in panel.get_title() and "\n" in panel.get_ylabel()
    assert 1 < len(panel.get_xticks()) < 5


def test_all_figure_functions_are_called_alike():
    rooms = (posterior, misfit, ledger, placement, structure, reach)
    returning = {
        function
        for room in rooms
        for function in vars(room).values()
        if inspect.isfunction(function)
        and function.__module__ == room.__name__
        and not function.__name__.startswith("_")
        and inspect.signature(function).return_annotation is Figure
    }
    assert returning == {*ONE_PANEL, *PANELS}
    for function in returning:
        drawn, *settings = inspect.signature(function).parameters.values()
        assert drawn.kind is drawn.POSITIONAL_OR_KEYWORD, name(function)
        assert {setting.kind for setting in settings} == {drawn.KEYWORD_ONLY}, name(function)
        assert settings[-1].name == ("ax" if function in ONE_PANEL else "axes"), name(function)
        required = {setting.name for setting in settings if setting.default is not None}
        assert required == {*NEEDED.get(function, {})}, name(function)


def test_an_experiment_on_a_line_is_drawn_where_its_instruments_are():
    axes = structure.experiment(ledgers.EXPERIMENT).axes[0]
    places = {line.get_label(): list(line.get_xdata()) for line in axes.lines[:3]}
    assert places == {
        "structure": [0.0, 1.0],
        "sensor as recorded": [0.2],
        "actuator as recorded": [0.3],
    }
    assert axes.get_xlabel() == "position along the structure [m]"
    assert {"s1", "a1"} < {text.get_text() for text in axes.texts}


def test_an_experiment_in_space_is_drawn_in_space():
    figure = structure.experiment(ledgers.in_space())
    figure.draw_without_rendering()
    (axes,) = figure.axes
    assert axes.name == "3d"
    np.testing.assert_allclose(np.ravel(axes.lines[1].get_data_3d()), (0.2, 0.3, 0.1))
