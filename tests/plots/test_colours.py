"""All figures have the colours of the project, which differ for the colour-blind as well."""

import ast
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import get_named_colors_mapping, to_hex

from bayes_placement.plots import _colours
from bayes_placement.plots import measurement as measurement_plots
from tests.io.uff.test_frfs import measurement as one_measurement
from tests.plots.test_placement import FIGURES

PLOTS = Path(_colours.__file__).parent
PALETTE = {value.lower() for name, value in vars(_colours).items() if name.isupper()}


def own_colours(figure):
    """Colours of curves and bands, without the greys; those of maps tell numbers."""
    for axis in figure.axes:
        shades = [part.get_color() for part in axis.lines]
        edges = [part.get_markeredgecolor() for part in axis.lines]
        bands = [to_hex(part.get_facecolor()[0]) for part in bands_of(axis)]
        yield from {to_hex(shade) for shade in (*shades, *edges, *bands)}


def bands_of(axis):
    """Filled areas whose colour tells no number; contour lines are not filled."""
    plain = [band for band in axis.collections if band.get_array() is None]
    return [band for band in plain if len(band.get_facecolor())]


@pytest.mark.parametrize("name", FIGURES)
def test_placements_are_drawn_in_the_colours_of_all_figures(name):
    assert {*own_colours(FIGURES[name]())} <= PALETTE


def test_a_measurement_is_drawn_in_the_colour_of_data():
    (page, *_) = measurement_plots.pages(one_measurement())
    assert {*own_colours(page)} == {_colours.DATA}


def test_the_phase_of_a_measurement_does_not_cross_from_end_to_end():
    turning = np.exp(1j * np.radians([170.0, -170.0, 175.0, 178.0])) * np.ones((2, 2, 4))
    (page, *_) = measurement_plots.pages(one_measurement(frf=turning, coherence=None))
    phase = page.axes[len(page.axes) // 2]
    np.testing.assert_allclose(phase.lines[0].get_ydata(), [170.0, np.nan, np.nan, 178.0])
    assert page.axes[0].get_ylabel() == "magnitude\n[dB re 1 (m/s)/N]"


def test_no_colour_has_a_name_of_matplotlib():
    # "r" and "C0" are others than those of the palette, and change with the style of the user.
    names = {*get_named_colors_mapping()} | {f"C{number}" for number in range(10)}
    offenders = [
        f"{path.relative_to(PLOTS)}, line {value.lineno}: {value.value}"
        for path in sorted(PLOTS.rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text()))
        for word, value in pairs(node)
        if "color" in word and isinstance(value, ast.Constant) and value.value in names
    ]
    assert not offenders


def pairs(node):
    """Names and values of the arguments of a call, or of a dictionary."""
    if isinstance(node, ast.Call):
        return [(argument.arg or "", argument.value) for argument in node.keywords]
    if isinstance(node, ast.Dict):
        keys = [getattr(key, "value", "") for key in node.keys]
        return list(zip(map(str, keys), node.values, strict=True))
    return []
