"""FRFs without a phase."""

from collections.abc import Iterator

import numpy as np

from .._noise_level import FEWEST_LINES
from ..observe import LogAmplitude
from .record import Fault, Record


def can_check(record: Record) -> bool:
    """Tell whether phases are observed, at lines enough."""
    observed = not isinstance(record.experiment.observe, LogAmplitude)
    return observed and record.frequency.size >= FEWEST_LINES


def check(record: Record) -> Iterator[Fault]:
    """Find FRFs without a phase."""
    real = [pair for pair in record.pairs if not np.any(np.nan_to_num(record.frf[pair]).imag)]
    if real:
        yield record.fault(
            real[0],
            0.0,
            0.0,
            f"{record.whose(real)} have no imaginary part at any line, as of amplitudes "
            "or real parts that were taken for complex FRFs; the phase is needed, since a "
            "damped structure turns it: give real and imaginary parts, or amplitudes and phases, "
            "or observe=observe.LogAmplitude().",
        )
