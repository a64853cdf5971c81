"""Figures of a misfit: values, units and legends."""

import io
import itertools
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from bayes_placement.criticism.check.misfit import Misfit
from bayes_placement.plots import misfit as misfit_plots

LINES = np.array([10.0, 20.0, 40.0, 80.0])
UNIT = "velocity per force [(m/s)/N]"
NOTHING = xr.Dataset()


def misfit(parts=True, levels=1, sensors=2):
    """Misfit of some sensors and an actuator, with arrays that tell themselves apart."""
    random = np.random.default_rng(3)
    level = ("force_level",) if levels > 1 else ()
    channel = ("sensor", "actuator", *level, "frequency")
    outputs = (*channel, "part") if parts else channel
    size = (sensors, 1, levels, LINES.size) if level else (sensors, 1, LINES.size)
    unit = UNIT if parts else f"log10 of {UNIT}"
    coordinates = {
        "sensor": [f"s{number + 1}+x" for number in range(sensors)],
        "actuator": ["a1+x"],
        "frequency": ("frequency", LINES, {"units": "Hz"}),
    }
    if parts:
        coordinates["part"] = ["real", "imaginary"]
    if levels > 1:
        coordinates["force_level"] = 0.5 * 4.0 ** np.arange(levels)

    def arrays(dims, units, *names):
        shape = (*size, 2) if dims == outputs and parts else size
        return {name: (dims, random.normal(size=shape), {"units": units}) for name in names}

    amplitude = f"log10 of {UNIT}"
    response = xr.Dataset(
        arrays(channel, amplitude, "measured", "mean", "low", "high")
        | arrays(channel, "noise deviations", "misfit")
        | arrays(outputs, unit, "residual")
        | arrays(outputs, "noise deviations", "residual_over_noise"),
        coords=coordinates,
    )
    response["misfit"] = abs(response["misfit"])
    response["misfit"][1, 0, ..., 2] = np.nan  # a gap is left blank
    discrepancy = xr.Dataset(arrays(outputs, unit, "mean", "low", "high"), coords=coordinates)
    return Misfit(NOTHING, {}, response, NOTHING, NOTHING, discrepancy, 0.01, True)


FIGURES = {name: getattr(misfit_plots, name) for name in ("residual_map", "discrepancy")}
CASES = {
    "complex": {},
    "logarithms": {"parts": False},
    "two force levels": {"levels": 2},
    "logarithms at two force levels": {"parts": False, "levels": 2},
}


def drawn(figure):
    """Draw a figure; a warning of the layout or of a missing value is an error in this suite."""
    figure.draw_without_rendering()
    return figure


def labels(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def line(axis, label):
    (curve,) = [line for line in axis.lines if line.get_label() == label]
    return curve.get_ydata()


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("name", FIGURES)
def test_every_axis_bears_a_name_and_a_unit(name, case):
    for axis in drawn(FIGURES[name](misfit(**CASES[case]))).axes:
        assert axis.get_xlabel().endswith("]") or not axis.get_xlabel()
        assert axis.get_ylabel().endswith("]")


@pytest.mark.parametrize("case", CASES)
def test_each_entry_of_the_legend_stands_once(case):
    entries = labels(misfit_plots.discrepancy(misfit(**CASES[case])))
    assert len(entries) == len(set(entries)) >= 3


@pytest.mark.parametrize("case", CASES)
def test_the_legend_lies_within_the_figure(case):
    figure = drawn(misfit_plots.discrepancy(misfit(**CASES[case])))
    box, frame = figure.legends[0].get_window_extent(), figure.bbox
    assert frame.x0 <= box.x0 and box.x1 <= frame.x1


def test_the_map_has_a_row_for_each_channel_and_a_column_for_each_line():
    result = misfit()
    figure = misfit_plots.residual_map(result)
    axis, bar = figure.axes
    (mesh,) = axis.collections[:1]
    values = np.ma.filled(mesh.get_array().astype(float), np.nan)
    np.testing.assert_array_equal(values, result.response["misfit"][:, 0])
    assert [text.get_text() for text in axis.get_yticklabels()] == ["s1+x, a1+x", "s2+x, a1+x"]
    edges = mesh.get_coordinates()[0, :, 0]
    assert np.all((edges[:-1] < LINES) & (edges[1:] > LINES))
    assert bar.get_ylabel() == "size of residual [noise deviations]"


def test_names_of_many_channels_stand_apart():
    figure = misfit_plots.residual_map(misfit(sensors=30))
    figure.savefig(io.BytesIO())
    boxes = [label.get_window_extent() for label in figure.axes[0].get_yticklabels()]
    assert len(boxes) == 30
    assert all(low.y1 < high.y0 for low, high in itertools.pairwise(boxes))


def test_each_force_level_has_a_map_of_its_own():
    result = misfit(levels=2)
    first, second, _ = misfit_plots.residual_map(result).axes
    assert [first.get_title(), second.get_title()] == ["residual, 0.5 N", "residual, 2 N"]
    values = second.collections[0].get_array()
    np.testing.assert_array_equal(values[0], result.response["misfit"][0, 0, 1])


def test_each_force_level_has_panels_of_its_own():
    result = misfit(levels=2)
    figure = misfit_plots.discrepancy(result)
    titles = [axis.get_title() for axis in figure.axes]
    pairs = [f"sensor s{n}+x, actuator a1+x" for n in (1, 2)]
    assert titles == [f"{pair}, {level} N" for pair in pairs for level in ("0.5", "2")]
    values = result.response["residual_over_noise"][1, 0, 1, :, 0]
    np.testing.assert_array_equal(line(figure.axes[3], "residual, real part"), values)


@pytest.mark.parametrize(("lines", "scale"), [([10, 20, 40, 80], "linear"), ([1, 2, 3, 80], "log")])
def test_lines_that_crowd_at_the_lower_end_are_spread(lines, scale):
    result = misfit()
    at = {"frequency": ("frequency", np.array(lines, dtype=float), {"units": "Hz"})}
    moved = replace(
        result,
        response=result.response.assign_coords(at),
        discrepancy=result.discrepancy.assign_coords(at),
    )
    for name, figure in FIGURES.items():
        assert drawn(figure(moved)).axes[0].get_xscale() == scale, name


def test_a_map_of_a_single_line_is_drawn():
    result = misfit()
    single = result.response.isel(frequency=[1])
    drawn(
        misfit_plots.residual_map(
            Misfit(NOTHING, {}, single, NOTHING, NOTHING, result.discrepancy, 0.01, True)
        )
    )


@pytest.mark.parametrize("parts", [True, False])
def test_the_discrepancy_is_drawn_part_by_part_with_the_residuals(parts):
    result = misfit(parts)
    axis = misfit_plots.discrepancy(result).axes[1]
    response = result.response.isel(sensor=1, actuator=0)
    noise = response["residual"] / response["residual_over_noise"]
    expected = {
        "discrepancy": result.discrepancy["mean"].isel(sensor=1, actuator=0) / noise,
        "residual": response["residual_over_noise"],
    }
    for number, part in enumerate([", real part", ", imaginary part"] if parts else [""]):
        for name, values in expected.items():
            drawn_values = values[:, number] if parts else values
            np.testing.assert_allclose(line(axis, f"{name}{part}"), drawn_values)
    assert axis.get_ylabel() == "discrepancy\n[noise deviations]"


def test_discrepancies_of_many_sensors_stand_on_pages():
    pages = misfit_plots.discrepancy_pages(misfit(sensors=7))
    assert [len(page.axes) for page in pages] == [3, 3, 1]
    assert pages[1].axes[0].get_title() == "sensor s4+x, actuator a1+x"
    assert max(page.get_figheight() for page in pages) <= 11.0
    for page in pages:
        page.savefig(io.BytesIO())


def test_residuals_at_many_force_levels_stand_on_a_page():
    figure = misfit_plots.residual_map(misfit(levels=5))
    figure.savefig(io.BytesIO())
    assert figure.get_figheight() <= 11.0


def test_discrepancies_at_many_force_levels_stand_on_pages():
    pages = misfit_plots.discrepancy_pages(misfit(levels=5))
    assert [len(page.axes) for page in pages] == [6, 4]  # two sensors at three and two levels
    assert pages[1].axes[0].get_title() == "sensor s1+x, actuator a1+x, 32 N"
    assert max(page.get_figwidth() for page in pages) <= 13.0
