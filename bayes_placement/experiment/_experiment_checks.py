"""_experiment_checks: in, lines, force levels and a word as given; out, the same, or an error.

Not known here: structures, instruments.
"""

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from .._types import InputError
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
