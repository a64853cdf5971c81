"""Figure of measured modes beside those of models."""

import numpy as np
import pytest
import xarray as xr

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.plots.report._saved import Saved
from bayes_placement.plots.report.content import Drawing
from bayes_placement.plots.report.sections import modes as section


def fit(offset=0.0, *, shapes=True):
    """What `fitted_modes` returns, written by hand: natural frequencies off by a share."""
    frequency, damping = np.array([10.0, 20.0]), np.array([0.01, 0.02])
    variables = {
        "number": ("mode", [1, 3]),
        "natural_frequency": ("mode", frequency),
        "natural_frequency_deviation": ("mode", 0.01 * frequency),
        "natural_frequency_of_model": ("mode", frequency * (1 + offset)),
        "damping_ratio": ("mode", damping),
        "damping_ratio_deviation": ("mode", 0.1 * damping),
        "damping_ratio_of_model": ("mode", 1.5 * damping),
    }
    if shapes:
        criterion = np.array([[1.0, 0.1, 0.0], [0.2, 0.3, 0.87]])
        variables["assurance"] = (("mode", "mode_of_model"), criterion)
        variables["mode_of_model"] = ("mode_of_model", [1, 2, 3])
    return xr.Dataset(variables, coords={"mode": [1, 2]})


def test_marks_are_where_the_numbers_are():
    figure = bp.plots.modes.compared({"as given": fit(0.03), "with point_mass": fit(-0.01)})
    frequency, damping, first, second = figure.axes
    offsets = {line.get_label(): line.get_ydata() for line in frequency.get_lines()}
    np.testing.assert_allclose(offsets["as given"], 3.0)
    np.testing.assert_allclose(offsets["with point_mass"], -1.0)
    (bars,) = frequency.containers
    _, caps, _ = bars.lines
    np.testing.assert_allclose(caps[1].get_ydata(), 1.96)  # 95 % of a deviation of 1 %
    (bars,) = damping.containers
    np.testing.assert_allclose(bars.lines[0].get_ydata(), [1.0, 2.0])
    for panel in (first, second):
        texts = [text.get_text() for text in panel.texts]
        assert texts == ["1.00", ".10", ".00", ".20", ".30", ".87"]
        frames = [patch.get_xy() for patch in panel.patches if not patch.get_fill()]
        assert frames == [(-0.5, -0.5), (1.5, 0.5)]  # modes 1 and 3 of the model
    assert frequency.get_xticklabels()[1].get_text() == "2\n20"


def test_what_was_not_measured_has_no_panel():
    without = fit(shapes=False)
    without["damping_ratio"] = without["damping_ratio"] * np.nan
    figure = bp.plots.modes.compared({"as given": without})
    (panel,) = figure.axes
    assert "natural frequency" in panel.get_ylabel()
    with pytest.raises(InputError, match="was given no model"):
        bp.plots.modes.compared({})


@pytest.mark.parametrize("count", [5, 9])
def test_modes_of_many_models_are_no_higher_than_a_page(count):
    figure = bp.plots.modes.compared({f"model {number}": fit() for number in range(count)})
    figure.draw_without_rendering()
    assert figure.get_figheight() <= 11.0
    assert sum(axis.axison for axis in figure.axes) == count + 2


def test_a_report_has_the_modes_with_their_numbers(tmp_path):
    results = xr.DataTree.from_dict({"/modes_0": fit(0.03), "/modes_1": fit(0.0)})
    about = {"models": ["as given", "with point_mass"]}
    parameters, assurance = section.items(Saved(tmp_path, about, results, {}, {}))
    assert isinstance(parameters.content, Drawing)
    table = parameters.data
    assert table.columns[:3] == (
        "measured mode",
        "natural frequency [Hz]",
        "natural frequency, standard deviation [Hz]",
    )
    assert table.rows[1][3:5] == pytest.approx((20.6, 20.0))
    assert "as given: natural frequency [Hz]" in table.columns
    assert len(assurance.data.rows) == 2 * 2 * 3
    assert "with point_mass" in assurance.content.svg
    assert not list(section.items(Saved(tmp_path, {}, xr.DataTree(), {}, {})))
