"""Modes of a model beside measured ones, against finite elements that this package did not make."""

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.criticism.findings.findings import Model, findings
from bayes_placement.criticism.fitted_modes import fitted_modes
from bayes_placement.plots.report import Report, write_report
from tests.experiment import modal_bars

PLACES = (0.12, 0.37, 0.81)
MASS = {"mass_at": 0.4, "mass": 0.5}


@pytest.fixture(scope="module")
def modal():
    """Measured without error, the model with the mass, and its modes."""
    measured = modal_bars.measured(PLACES, 3, ratio=0.01, **MASS)
    experiment = modal_bars.experiment(measured, PLACES) + bp.effects.point_mass(
        MASS["mass_at"], MASS["mass"]
    )
    return measured, experiment, fitted_modes(experiment, measured, {})


def test_the_right_model_has_the_modes_of_finite_elements(modal):
    _, _, fit = modal
    assert fit["number"].values.tolist() == [1, 2, 3]
    for name, tolerance in (("natural_frequency", 1e-4), ("damping_ratio", 1e-3), ("shape", 3e-3)):
        measured, model = fit[name].values, fit[f"{name}_of_model"].values
        np.testing.assert_allclose(model, measured, rtol=tolerance, atol=1e-4 * measured.max())
    np.testing.assert_allclose(fit["natural_frequency_deviation"], 1e-3 * fit["natural_frequency"])


def test_the_assurance_is_that_of_the_shapes(modal):
    """Of modes up to two above the measured ones; finite elements have the shapes of all."""
    _, _, fit = modal
    assert fit["mode_of_model"].values.tolist() == [1, 2, 3, 4, 5]
    _, _, shapes = modal_bars.poles(5, ratio=0.01, **MASS)
    shapes = shapes[[modal_bars.node(place) for place in PLACES]].real
    product = (fit["shape"].values.T @ shapes) ** 2
    sizes = np.outer(np.sum(fit["shape"].values ** 2, axis=0), np.sum(shapes**2, axis=0))
    np.testing.assert_allclose(fit["assurance"], product / sizes, atol=5e-3)


def test_findings_hold_modes_in_the_place_of_responses(modal):
    measured, experiment, fit = modal
    model = Model("as given", experiment, {})
    tree = findings([model], {}, measured, {"command": "improve"})
    assert "fit_0" not in tree.children
    assert tree["modes_0"].to_dataset().equals(fit)
    assert tree["places"]["item"].values.tolist() == ["s0", "s1", "s2", "point_mass"]


def test_a_report_tells_frequencies_damping_and_assurance_of_modes(modal, tmp_path):
    measured, experiment, fit = modal
    tree = findings([Model("as given", experiment, {})], {}, measured, {"command": "improve"})
    bp.io.netcdf.write(tree, tmp_path / "findings.nc")
    (chapter,) = Report.read(write_report(tmp_path)).chapters
    tables = {item.title: item.content for item in chapter.items}
    rows = np.array(tables["Natural frequencies and damping"].rows)
    np.testing.assert_allclose(rows[:, 1], fit["natural_frequency"], rtol=1e-4)
    assert np.abs(rows[:, 2:4]).max() < 0.02  # [%] as drawn and as given, which are the same here
    np.testing.assert_allclose(rows[:, 4], 100 * fit["damping_ratio"], rtol=1e-2)
    given = dict(zip(*np.array(tables["Modal assurance criterion"].rows)[:, :2].T, strict=True))
    assert given == {"as drawn": "1.0", "as given": "1.0"}
