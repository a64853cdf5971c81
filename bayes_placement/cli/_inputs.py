"""What every command begins with: the study, its measurement, the folder, the posterior."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .._shared.errors import InfeasibleError, InputError, UsageError
from .._shared.progress import Progress
from ..experiment._experiment_checks import at_levels
from ..experiment._measurement_words import span_in_words
from ..experiment.data_checks import DataChecks
from ..experiment.experiment import Experiment, Measurements
from ..experiment.modal_parameters import ModalParameters
from ..experiment.model_error import Embedded
from ..experiment.variants import observing_modes, with_lines_at
from ..io import case, formats, modal_parameters, model
from ..io._gate import files_read
from ..io._modal_arrays import holds_modal_parameters
from ._run import KeptAnswer, Output, Run
from ._terminal import Screen

if TYPE_CHECKING:  # they take long to import, and a page stands before
    import xarray as xr

    from ..inference.cross_check import Method


class Inputs(NamedTuple):
    """What a command was given and has read, with the faults of the data that were printed.

    `is_thinned` says that lines were left out.
    """

    screen: Screen
    run: Run
    study: model.Study
    measurement: Measurements
    data_faults: list[str]
    is_thinned: bool = False

    @property
    def experiment(self) -> Experiment:
        """The experiment of the study."""
        return self.study.experiment


def read_inputs(
    path: Path,
    data: Path | None,
    command: str,
    output: Output,
    most_lines: int | None,
    model_error: bool = False,
    *,
    is_quick: bool = False,
    **settings: Any,
) -> Inputs:
    """Read study and measurement, make the folder of the results, and print what is begun with.

    That is the experiment, which lines are taken and why, and what is wrong with the data; of what
    is to be quick, the lines alone.

    No `most_lines` means all, as long as there are not too many values. `model_error` says that
    modes and channels differ from the model by unknown sizes; one that the study declares stays.
    Settings are further options of the command, for the record.
    """
    screen = output.screen
    with files_read() as files:
        study, measurement = read_both(path, data, command)
    if model_error and study.experiment.model_error is None:
        study = study._replace(experiment=study.experiment.with_model_error(Embedded()))
    given, lines = study.experiment, chosen_lines(screen, study, measurement, most_lines)
    study = study._replace(experiment=lines.experiment)
    has_error = study.experiment.model_error is not None
    settings = {"lines": most_lines, "model_error": has_error, **settings}
    run = output.begin(command, path, files=files, **settings)
    if not is_quick:
        screen.text(f"{study.experiment}\n")
    screen.text(lines.sentence)
    faults = (
        [] if is_quick else print_data_faults(screen, study, measurement, output.fits, stops=True)
    )
    return Inputs(screen, run, study, measurement, faults, lines.experiment is not given)


MOST_VALUES = 50_000
"""Most values of FRFs that are taken where no number of lines is asked for."""


class ChosenLines(NamedTuple):
    """The experiment at the lines that are taken, and a sentence that says which and why."""

    experiment: Experiment
    sentence: str


def choose_lines(
    experiment: Experiment, measurement: Measurements, most: int | None
) -> ChosenLines:
    """Take at most some lines of an experiment, those at which its measurement changes most.

    None means as many as make 50,000 values.
    """
    if experiment.observe.is_modal:
        return ChosenLines(experiment, _words_on_modes(experiment, measurement))
    channels = experiment.sensor_channels, experiment.actuator_channels
    runs = [
        run.lines(np.asarray(experiment.frequency)).channels(*channels)
        for run in at_levels(measurement, experiment.force_levels)
    ]
    pairs = sum(int(run.measured.sum()) for run in runs)
    limit = most if most is not None else max(1, MOST_VALUES // pairs)
    lines = runs[0].frequency
    if lines.size <= limit:
        return ChosenLines(
            experiment, f"Lines: all {lines.size} of the experiment, {span_in_words(lines)}."
        )
    kept = runs[0].thinned(limit, together=runs[1:]).frequency
    reason = (
        f"--lines {most} was given"
        if most is not None
        else f"{lines.size * pairs} values take long (--lines {lines.size} takes all)"
    )
    return ChosenLines(
        with_lines_at(experiment, np.searchsorted(lines, kept)),
        f"Lines: {kept.size} of {lines.size}, {span_in_words(kept)}, dense where the FRFs change "
        f"most against their noise, since {reason}.",
    )


def _words_on_modes(experiment: Experiment, measurement: Measurements) -> str:
    """Say which modes are taken, and which of their shapes are not."""
    words = f"Modes: all {np.size(experiment.frequency)} that were measured"
    measured = measurement.sensors if isinstance(measurement, ModalParameters) else ()
    names = dict.fromkeys(channel.name for channel in measured)
    others = [name for name in names if name not in experiment.sensor]
    if not others:
        return f"{words}."
    return f"{words}; shapes at {', '.join(others)} not, since the model has no such sensors."


def chosen_lines(
    screen: Screen, study: model.Study, measurement: Measurements, most: int | None
) -> ChosenLines:
    """Choose lines; where they were not measured, faults of the data say why, as in rad/s."""
    try:
        return choose_lines(study.experiment, measurement, most)
    except InputError:
        print_data_faults(screen, study, measurement)
        raise


def print_data_faults(
    screen: Screen,
    study: model.Study,
    measurement: Measurements,
    fits: Path | None = None,
    *,
    stops: bool = False,
) -> list[str]:
    """Print what the checks of the data say, and return the faults.

    A model of which all natural frequencies are below the lines may stop the command: no effect
    that it lacks raises all of them. What an earlier run found is taken from the folder of fits.
    """
    answer = KeptAnswer(fits, "check_data", study.experiment, measurement)
    checks: DataChecks | None = answer.read()
    if checks is None:
        checks = study.experiment.check_data(measurement)
        answer.write(checks)
    for fault in checks.faults.get("natural frequencies", ()):
        if stops and fault.value > fault.threshold:
            raise InputError(fault.sentence)
    screen.list(checks.words())
    screen.text("")
    return checks.sentences()


def read_study(path: Path) -> model.Study:
    """Read a model file, or the case in a folder."""
    return case.read(path) if path.is_dir() else model.read(path)


def read_both(path: Path, data: Path | None, command: str) -> tuple[model.Study, Measurements]:
    """Read a study, whose experiment observes what was measured, and the measurement."""
    study = read_study(path)
    measurement = measured(study, data, path, command)
    declared = study.experiment.observe.is_modal and data is None
    return study if declared else observing(study, measurement), measurement


def observing(study: model.Study, measurement: Measurements) -> model.Study:
    """Let the experiment of a study observe a measurement: one of FRFs may become one of modes."""
    if not isinstance(measurement, ModalParameters):
        return study
    return study._replace(experiment=observing_modes(study.experiment, measurement))


def read_measurement(path: Path) -> Measurements:
    """Read FRFs or modal parameters, by what a file holds."""
    if holds_modal_parameters(path):
        return modal_parameters.read(path)
    return formats.read_measurement(path)


def measured(study: model.Study, data: Path | None, path: Path, command: str) -> Measurements:
    """Return the measurement in a file, or that of the study; of several states the last."""
    if data is not None:
        return read_measurement(data)
    if study.measurement is None and study.states:
        return [*study.states.values()][-1]
    if study.measurement is None:
        raise UsageError(
            f"{path} declares no `measurement` and no --data file is given. Measured FRFs are "
            f"needed: bayes-placement {command} {path} --data measured.uff"
        )
    return study.measurement


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


@contextmanager
def fits_of_model(inputs: Inputs) -> Iterator[None]:
    """Keep the fits of what follows for later runs, and say how many of earlier runs were taken."""
    from ..criticism.kept_fits import fits_kept_in

    with fits_kept_in(inputs.run.fits) as fits:
        yield
    if fits is not None and fits.taken:
        inputs.screen.text(
            f"Fits and scans of an earlier run that are used again: {fits.taken} of {fits.folder}/"
        )


def method_from_fit(inputs: Inputs, engine: str) -> tuple["Method", tuple[str, ...]]:
    """Return the method of an engine, and what to doubt in the fit that it begins at.

    Laplace's method begins at the fit that `explain` and `improve` begin with, unless the study
    says how its modes are searched for, or a prior has no inverse distribution function.
    """
    from ..criticism.missing.as_given import fitted_as_given
    from ..inference.engines.map import MAP

    method = named_method(inputs.study, engine, "latent")
    if not isinstance(method.engine, MAP) or method.engine is inputs.study.engine:
        return method, ()
    try:
        with fits_of_model(inputs), inputs.screen.progress(["fit"]) as begin:
            progress = begin("fit")
            fit = fitted_as_given(inputs.experiment, inputs.measurement)
            progress(1.0)
    except InfeasibleError:
        return method, ()
    return method._replace(engine=MAP(begin=fit.values)), fit.cautions
