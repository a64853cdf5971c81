"""Lines with values that nothing can have, such as a coherence above one: left out of a file."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Complex, Float

from .._shared.errors import warn
from ._gate import FileWarning

MOST = 0.5
"""Share of such lines from which on the file as a whole is refused."""


def usable_lines(
    path: Path,
    frequency: Float[np.ndarray, "frequency"],
    frf: Complex[np.ndarray, "sensor actuator frequency"],
    coherence: Float[np.ndarray, "sensor actuator frequency"] | None,
) -> Bool[np.ndarray, "frequency"]:
    """Tell which lines are read, and warn of the others.

    Parameters
    ----------
    path
        The file, for the warning.
    frequency
        Frequencies [Hz].
    frf
        FRFs, NaN for pairs that were not measured.
    coherence
        Their coherence [1], NaN for pairs where unknown; None where there is none.
    """
    measured = ~np.isnan(frf).all(axis=-1, keepdims=True)
    wrong = measured & ~np.isfinite(frf)
    if coherence is not None:
        known = measured & ~np.isnan(coherence).all(axis=-1, keepdims=True)
        wrong |= known & ~((coherence >= 0) & (coherence <= 1))
    lines = wrong.any(axis=(0, 1))
    if not lines.any() or lines.mean() >= MOST:
        return np.ones(lines.shape, dtype=bool)  # what is wrong everywhere is refused
    shown = ", ".join(f"{value:g}" for value in frequency[lines][:5])
    warn(
        f"{path}: {lines.sum()} of {lines.size} lines were left out ({shown}"
        f"{', ...' if lines.sum() > 5 else ''} Hz), since a coherence outside of 0 to 1, or an FRF "
        "that is not finite, is no measurement. Look for overloads or too few averages there.",
        FileWarning,
    )
    return ~lines
