"""Sentences on a measurement and an experiment, and the table of its priors."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .._shared.reprs import PRIOR_HEADINGS, prior_rows
from .._shared.sites import Role, Unknown
from .quantities import quantity_of

if TYPE_CHECKING:
    from .experiment import Experiment
    from .measurement import Measurement


def lines_in_words(lines: np.ndarray) -> str:
    """Say how many lines there are, and where."""
    return f"{counted(lines.size, 'line')} {span_in_words(lines)}"


def span_in_words(lines: np.ndarray) -> str:
    """Say from where to where lines reach, in Hz."""
    low, high = lines.min(), lines.max()
    return f"at {low:g} Hz" if lines.size == 1 else f"from {low:g} to {high:g} Hz"


def sentence(measurement: "Measurement") -> str:
    """Say what was measured: quantity, channels, lines and what is known of the noise."""
    averages = "" if measurement.averages is None else f", {measurement.averages} averages"
    level = measurement.force_level
    force = "" if level is None else f", force {level:g} N"
    return (
        f"Measurement: {measurement.quantity} [{quantity_of(measurement.quantity).unit}] of "
        f"{counted(len(measurement.sensors), 'sensor channel')} for "
        f"{counted(len(measurement.actuators), 'actuator channel')}, "
        f"{counted(int(measurement.measured.sum()), 'pair')} measured, "
        f"{lines_in_words(measurement.frequency)}, "
        f"{_known(measurement)}{averages}{force}."
    )


def _known(measurement: "Measurement") -> str:
    coherence = "no coherence" if measurement.coherence is None else "with coherence"
    return coherence if measurement.variance is None else f"{coherence} and with variance"


def counted(number: int, noun: str) -> str:
    """Return a number and its noun, in the plural where it is not one."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def sentence_on(experiment: "Experiment") -> str:
    """Say how many channels and lines an experiment observes."""
    lines = np.asarray(experiment.frequency)
    sensors, actuators = len(experiment.sensor_channels), len(experiment.actuator_channels)
    if experiment.observe.is_modal:
        return (
            f"Experiment: {lines.size} modes from {lines.min():g} to {lines.max():g} Hz, shapes at "
            f"{sensors} sensor channels, z = {experiment.observe.label}"
        )
    return (
        f"Experiment: {sensors} sensor x {actuators} actuator channels, {lines_in_words(lines)}, "
        f"z = {experiment.observe.label}"
    )


def prior_table(unknowns: Sequence[Unknown]) -> list[str]:
    """Return the lines of the table: column headings, then one line for each unknown.

    The standard errors of a model error are one line, since there are many.
    """
    rows: list[tuple[str, ...]] = [PRIOR_HEADINGS, *prior_rows(unknowns)]
    return [*_table(rows), *_of_noise(unknowns)]


def _of_noise(unknowns: Sequence[Unknown]) -> list[str]:
    """Say that the level of the noise is not known, where it is not."""
    names = [unknown.name for unknown in unknowns if unknown.role is Role.OUTPUT_ERROR]
    words = "The level of the noise is not known: it is inferred with all else"
    return [f"{words} ({', '.join(names)})."] if names else []


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return ["  ".join(word.ljust(w) for word, w in zip(row, widths, strict=True)) for row in rows]
