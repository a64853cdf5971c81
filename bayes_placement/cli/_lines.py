"""Which lines a command takes, and why."""

from typing import NamedTuple

import numpy as np

from ..experiment._experiment_checks import at_levels
from ..experiment._measurement_words import span_in_words
from ..experiment.experiment import Experiment, Measurements
from ..experiment.modal_parameters import ModalParameters
from ..experiment.variants import with_lines_at

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
        return ChosenLines(experiment, _modes(experiment, measurement))
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


def _modes(experiment: Experiment, measurement: Measurements) -> str:
    """Say which modes are taken, and which of their shapes are not."""
    words = f"Modes: all {np.size(experiment.frequency)} that were measured"
    measured = measurement.sensors if isinstance(measurement, ModalParameters) else ()
    names = dict.fromkeys(channel.name for channel in measured)
    others = [name for name in names if name not in experiment.sensor]
    if not others:
        return f"{words}."
    return f"{words}; shapes at {', '.join(others)} not, since the model has no such sensors."
