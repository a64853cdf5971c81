"""The model as given, fitted as `explain` and `improve` fit it, so that a fit serves all three."""

from typing import NamedTuple

import numpy as np

from ...experiment.experiment import Experiment, Measurements
from ._cautions import cautions_of_fit
from ._errors_as_identified import given_with_errors
from ._hypotheses import null_hypothesis


class AsGiven(NamedTuple):
    """Best fit of a model as it was given, and what to doubt in it, a sentence each."""

    values: dict[str, np.ndarray]
    cautions: tuple[str, ...]


def fitted_as_given(experiment: Experiment, measurement: Measurements) -> AsGiven:
    """Fit a model as it is given; `fits_kept_in` shares the fit."""
    fit = null_hypothesis(experiment.with_errors(None), experiment.data(measurement))
    if experiment.model_error is not None:
        fit = given_with_errors(fit, experiment.model_error)
    named = fit.problem.coordinates.named(fit.fit.point[None])
    values = {name: value[0] for name, value in named.items()}
    sizes = {name: np.asarray(size) for name, size in fit.problem.sizes.items()}
    return AsGiven(values | sizes, cautions_of_fit(fit))
