"""_studies: in, a model file or a case folder; out, its experiment, measurement and posterior.

Not known here: the terminal, what is done with a posterior.
"""

import warnings
from pathlib import Path

import xarray as xr

from .._types import InputError, Progress
from ..experiment.experiment import Experiment, Measurements
from ..inference import methods
from ..inference.infer import InferenceWarning, infer
from ..io import case, model, uff


def read(path: Path) -> model.Study:
    """Read a model file, or the case in a folder.

    Raises
    ------
    FileNotFoundError
        If there is no such file, or no case in the folder.
    ValueError
        If what is there does not declare an experiment.
    """
    return case.read(path) if path.is_dir() else model.read(path)


def measured(study: model.Study, data: Path | None, path: Path, command: str) -> Measurements:
    """Return the data of a file, or those that the study brings along.

    Raises
    ------
    ValueError
        If there are neither.
    """
    if data is not None:
        return uff.read(data, require_positions=False)
    if study.measurement is None:
        raise InputError(
            f"{path} declares no `measurement` and no --data file is given. Measured FRFs are "
            f"needed: bayes-placement {command} {path} --data measured.uff"
        )
    return study.measurement


def method(study: model.Study, engine: str, marginal: str) -> methods.Method:
    """Return a method by its names, of the sizes that the study declares for its engine."""
    chosen, own = methods.method(engine, marginal), study.engine
    return chosen._replace(engine=own) if own and type(own) is type(chosen.engine) else chosen


def inferred(
    experiment: Experiment,
    measurement: Measurements,
    method: methods.Method,
    seed: int,
    progress: Progress,
) -> xr.DataTree:
    """Infer by a method; its complaints are lines of a report, not warnings."""
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
