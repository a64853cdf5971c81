"""Sizes and locations of a model error in a check."""

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from tests.inference.engines.test_mode_with_sizes import ERRORS, case  # noqa: F401  a fixture


@pytest.fixture(scope="module")
def misfit(case):  # noqa: F811
    return bp.check(bp.infer(*case, engine=bp.engines.MAP(starts=8)))


def test_the_model_passes_given_its_error_whose_size_is_said(misfit):
    (errors,) = misfit.model_error
    assert errors.kind == "frequency"
    assert errors.low < np.sqrt(np.mean(ERRORS**2)) < errors.high
    assert errors.where == "mode 4" and errors.largest == pytest.approx(-0.015, rel=0.05)
    assert misfit.passed
    assert not any("standard" in str(name) for name in misfit.edges["unknown"].values)
    words = " ".join(misfit.words())
    assert "given its model error" in words and "mode 4: -1.5 %" in words


def test_chi2_without_the_errors_is_that_of_the_exact_model(misfit, case):  # noqa: F811
    experiment, measurement = case
    exact = experiment.with_model_error(None)
    data = exact.data(measurement)
    predicted = np.asarray(compiled(bp.Experiment.predict)(exact))
    relative = (data.z - predicted) / np.asarray(exact.noise.deviation(data))
    assert misfit.chi2_without_errors == pytest.approx(float(np.mean(relative**2)), rel=1e-6)
    assert misfit.chi2_without_errors > 100
