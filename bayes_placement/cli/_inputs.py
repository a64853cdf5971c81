"""What every command begins with: the study, its measurement, the folder, the posterior."""

import warnings
from pathlib import Path
from typing import NamedTuple

import xarray as xr
from rich.console import Console

from .._progress import terminal_console
from .._types import InputError, Progress
from ..experiment.experiment import Experiment, Measurements
from ..inference import cross_check
from ..inference.infer import InferenceWarning, infer
from ..io import case, formats, model
from ._result_files import make_folder
from ._terminal import print_text


class Inputs(NamedTuple):
    """What a command was given.

    Parameters
    ----------
    console
        The terminal.
    study
        The model file or case folder, read.
    measurement
        What was measured.
    """

    console: Console
    study: model.Study
    measurement: Measurements

    @property
    def experiment(self) -> Experiment:
        """The experiment of the study."""
        return self.study.experiment


def read_inputs(path: Path, data: Path | None, command: str, out: Path) -> Inputs:
    """Read study and measurement, make the folder of the results, and print the experiment.

    Parameters
    ----------
    path
        Model file or case folder.
    data
        Universal file of the measurement; None for that of the study.
    command
        Name of the command, for messages.
    out
        Folder of the results.

    Raises
    ------
    FileNotFoundError
        If a file is not there.
    InputError
        If a file does not hold what is needed.
    """
    console = terminal_console()
    study = read_study(path)
    measurement = read_measurement(study, data, path, command)
    make_folder(out)
    print_text(console, f"{study.experiment}\n")
    return Inputs(console, study, measurement)


def read_study(path: Path) -> model.Study:
    """Read a model file, or the case in a folder.

    Raises
    ------
    FileNotFoundError
        If there is no such file, or no case in the folder.
    InputError
        If it does not declare an experiment.
    """
    return case.read(path) if path.is_dir() else model.read(path)


def read_measurement(
    study: model.Study, data: Path | None, path: Path, command: str
) -> Measurements:
    """Return the measurement in a file, or that of the study.

    Raises
    ------
    InputError
        If there is neither.
    """
    if data is not None:
        return formats.read_measurement(data)
    if study.measurement is None:
        raise InputError(
            f"{path} declares no `measurement` and no --data file is given. Measured FRFs are "
            f"needed: bayes-placement {command} {path} --data measured.uff"
        )
    return study.measurement


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
