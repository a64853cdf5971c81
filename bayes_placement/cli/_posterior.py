"""The posterior by a method that the command line names."""

import warnings
from typing import TYPE_CHECKING

from .._shared.progress import Progress
from ..experiment.experiment import Experiment, Measurements
from ..io import model

if TYPE_CHECKING:  # they take long to import, and a page stands before
    import xarray as xr

    from ..inference.cross_check import Method


def named_method(study: model.Study, engine: str, marginal: str) -> "Method":
    """Return a method by its names, with the engine of the study where it is of that kind."""
    from ..inference import cross_check

    method = cross_check.method(engine, marginal)
    if study.engine is not None and type(study.engine) is type(method.engine):
        return method._replace(engine=study.engine)
    return method


def infer_posterior(
    experiment: Experiment,
    measurement: Measurements,
    method: "Method",
    seed: int,
    progress: Progress,
) -> "xr.DataTree":
    """Infer by a method; its warnings become lines of the report."""
    from ..inference.infer import InferenceWarning, infer

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
