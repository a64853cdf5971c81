"""Checks of the arguments of an experiment: lines, force levels, mounting of the sensors."""

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from .._types import InputError
from ..modes.modes import Modes
from .recording import MOUNTINGS


def lines(frequency: Any) -> Any:
    """Return lines [Hz] as an array.

    Raises
    ------
    InputError
        If they are no list of finite numbers that are not negative.
    """
    if isinstance(frequency, jax.core.Tracer):
        return frequency
    array = np.asarray(frequency, dtype=float)
    if array.ndim != 1 or array.size == 0 or not np.all(np.isfinite(array)) or np.any(array < 0):
        raise InputError(
            f"frequency of shape {array.shape} was given; a list of lines [Hz], finite and not "
            "negative, is needed: frequency=[21.65, 64.95]."
        )
    return array


def static_line(frequency: Any, modes: Modes) -> None:
    """Refuse 0 Hz for a structure that moves as a rigid body.

    Raises
    ------
    InputError
        If there is a line at 0 Hz.
    """
    if isinstance(frequency, jax.core.Tracer) or modes.rigid_body_modes == 0:
        return
    if np.any(np.asarray(frequency) == 0):
        raise InputError(
            f"A line at 0 Hz was given, but the structure has {modes.rigid_body_modes} rigid-body "
            "modes; lines above 0 Hz are needed, since a constant force accelerates a free "
            "structure without limit: frequency=frequency[frequency > 0]."
        )


def levels(amplitudes: Sequence[float] | None) -> tuple[float, ...] | None:
    """Return force amplitudes [N]; None where they are not known.

    Raises
    ------
    InputError
        If there is none, one is not positive and finite, or one is given twice.
    """
    if amplitudes is None:
        return None
    forces = tuple(float(amplitude) for amplitude in amplitudes)
    positive = all(0 < force < np.inf for force in forces)
    if not forces or not positive or len(set(forces)) < len(forces):
        raise InputError(
            f"force_levels={forces} was given; force amplitudes [N] are needed, positive and each "
            "once, since a nonlinear response depends on them: force_levels=[0.1, 1.0]."
        )
    return forces


def mounting(word: str) -> str:
    """Return how sensors are mounted, one of `MOUNTINGS`.

    Raises
    ------
    InputError
        If it is another word.
    """
    if word not in MOUNTINGS:
        raise InputError(
            f"sensors_mounted={word!r} was given; it must be 'roving', where each sensor is alone "
            "in its run, or 'fixed', where all are mounted all the time: sensors_mounted='fixed'."
        )
    return word
