"""The table of an experiment: every unknown with its prior, unit and role."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .._shared.reprs import PRIOR_HEADINGS, prior_rows
from .._shared.sites import Role, Unknown
from ._measurement_words import lines_in_words

if TYPE_CHECKING:  # the class imports this module
    from .experiment import Experiment


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
