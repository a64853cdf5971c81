"""Checks of what an experiment is given: lines, force levels, the way sensors are mounted."""

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from .._types import InputError
from ..modes.modes import Modes
from .recording import MOUNTINGS


def lines(frequency: Any) -> Any:
    """Lines [Hz], finite and not negative."""
    if isinstance(frequency, jax.core.Tracer):
        return frequency
    given = np.asarray(frequency, dtype=float)
    if given.ndim != 1 or given.size == 0 or not np.all(np.isfinite(given)) or np.any(given < 0):
        raise InputError(
            f"frequency of shape {given.shape} was given; a list of lines [Hz], finite and not "
            "negative, is needed: frequency=[21.65, 64.95]."
        )
    return given


def at_rest(frequency: Any, modes: Modes) -> None:
    """Refuse 0 Hz for a structure that moves as a rigid body.

    Raises
    ------
    InputError
        If there is such a line.
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
    """Force amplitudes [N], positive and each once; None where they are not known."""
    if amplitudes is None:
        return None
    given = tuple(float(level) for level in amplitudes)
    if not given or not all(0 < level < np.inf for level in given) or len(set(given)) < len(given):
        raise InputError(
            f"force_levels={given} was given; force amplitudes [N] are needed, positive and each "
            "once, since a nonlinear response depends on them: force_levels=[0.1, 1.0]."
        )
    return given


def mounting(word: str) -> str:
    """One of the words for how sensors are mounted."""
    if word not in MOUNTINGS:
        raise InputError(
            f"sensors_mounted={word!r} was given; it must be 'roving', where each sensor is alone "
            "in its run, or 'fixed', where all are mounted all the time: sensors_mounted='fixed'."
        )
    return word
