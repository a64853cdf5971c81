"""What was measured, in one sentence."""

from typing import TYPE_CHECKING

import numpy as np

from .quantities import quantity_of

if TYPE_CHECKING:
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
