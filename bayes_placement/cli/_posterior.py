"""The posterior by a method that the command line names."""

import warnings

import xarray as xr

from .._shared.progress import Progress
from ..experiment.experiment import Experiment, Measurements
from ..inference import cross_check
from ..inference.infer import InferenceWarning, infer
from ..io import model


def named_method(study: model.Study, engine: str, marginal: str) -> cross_check.Method:
    """Return a method by its names, with the engine of the study where it is of that kind."""
    method = cross_check.method(engine, marginal)
    if study.engine is not None and type(study.engine) is type(method.engine):
        return method._replace(engine=study.engine)
    return method


def infer_posterior(
    experiment: Experiment,
    measurement: Measurements,
    method: cross_check.Method,
    seed: int,
    progress: Progress,
) -> xr.DataTree:
    """Infer by a method; its warnings become lines of the report."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InferenceWarning)
        return infer(
            experiment,
            measurement,
            engine=method.engine,
            marginal=method.marginal,
            key=seed,
            progress=progress,
        )
