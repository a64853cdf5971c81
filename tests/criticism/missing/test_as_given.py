"""The model as given is fitted once for `check`, `explain` and `improve`."""

import numpy as np
import pytest

from bayes_placement.criticism.kept_fits import fits_kept_in
from bayes_placement.criticism.missing import _shared_fits
from bayes_placement.criticism.missing.as_given import fitted_as_given
from bayes_placement.criticism.missing.improve import improve
from bayes_placement.effects import library
from bayes_placement.experiment.model_error import Embedded
from tests.criticism.small import MASS, experiment, measured

ERRORS = Embedded(shape=None, stiffness_and_mass=None, modes=3)


@pytest.mark.parametrize("errors", [None, ERRORS])
def test_it_is_the_first_step_of_improve_to_the_last_bit(errors, tmp_path):
    _shared_fits._LAST.clear()
    model, data = experiment(), measured(MASS, seed=1)
    model = model if errors is None else model.with_model_error(errors)
    candidates = library(model, ["point_mass"])
    ledger = improve(model, data, candidates=candidates, most_effects=1, store=tmp_path)
    with fits_kept_in(tmp_path) as fits:
        fit = fitted_as_given(model, data)
    assert fits.taken == (1 if errors is None else 3)
    first = ledger.steps[0].values
    for name in first.keys() & fit.values.keys():
        assert first[name] == pytest.approx(float(fit.values[name]), rel=0.05)
    assert {name.partition("[")[0] for name in first} == set(fit.values)


def test_a_model_without_errors_has_no_sizes():
    fit = fitted_as_given(experiment(), measured(seed=1))
    assert all(np.isfinite(value).all() for value in fit.values.values())
    assert not any("size" in name for name in fit.values)
