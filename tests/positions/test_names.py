"""Names are refused where they are given, or carried to every table, figure and file."""

import re

import numpy as np
import pytest
from matplotlib.figure import Figure

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.modes.finite_elements.affine_modes import NamedMatrices
from bayes_placement.plots._figures import panels

UNPRINTABLE = ["a\0", "s1\x1b[2J", "a\nb", "s\udcff", "a\u202eb", "\u200b", " ", "a" * 101]


@pytest.mark.parametrize("name", UNPRINTABLE, ids=ascii)
@pytest.mark.parametrize(
    "make",
    [
        lambda name: bp.Sensor(name, at=0.1),
        lambda name: bp.Actuator(name, at=0.1),
        lambda name: bp.effects.point_mass(0.1, mass=1.0, name=name),
        lambda name: bp.Measurement.from_arrays(
            [1j], [1.0], sensors=[bp.Channel(name)], actuators=["a1"], quantity="mobility"
        ),
        lambda name: NamedMatrices.of({name: np.eye(2)}, 2),
    ],
    ids=["sensor", "actuator", "effect", "channel", "part"],
)
def test_a_name_that_cannot_be_printed_is_refused(make, name):
    with pytest.raises(InputError, match="was given; a name of at most 100 letters is needed"):
        make(name)


def test_a_channel_that_differs_in_case_or_form_alone_is_hinted_at():
    measured = bp.Measurement.from_arrays(
        [[[1j]], [[2j]]], [1.0], sensors=["S1", "e\u0301"], actuators=["a1"], quantity="mobility"
    )
    for asked, measured_name in (("s1", "'S1'"), ("é", r"'e\u0301'")):
        words = f"{measured_name} differs from {asked!a} in case"
        with pytest.raises(InputError, match=re.escape(words)):
            measured.channels([asked], ["a1"])


@pytest.mark.parametrize(
    "name", ["$x_1^{$", r"\$", r"$\mathdefault{^{$", "a $ b", r"$\frac$", "梁"]
)
def test_a_dollar_in_a_figure_is_a_dollar(tmp_path, name):
    layout = panels(1, 1)
    layout.only.plot([1e-4, 1e4], [1, 2], label=name)
    layout.only.set(title=name, xscale="log")
    layout.only.set_yticks([1, 2], [name, "b"])
    figure = layout.with_legend()
    figure.savefig(tmp_path / "names.svg", metadata={"Date": None})
    ticks = layout.only.get_xticklabels()
    assert any(r"\mathdefault{10^{" in tick.get_text() and tick.get_parse_math() for tick in ticks)
    assert not layout.only.title.get_parse_math() or "$" not in name
    assert isinstance(figure, Figure)
