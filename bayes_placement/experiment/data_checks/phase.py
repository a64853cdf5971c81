"""Turn of the phase: it falls through each resonance, whatever the sign of the response."""

from collections.abc import Iterator

import numpy as np

from ..._types import ComplexSpectrum
from .._noise_level import FEWEST_LINES
from ..observe import LogAmplitude
from .prior_responses import prior_responses
from .record import Fault, Pair, Record

WRONG_WAY = 0.5
"""Turn from which on the phase rises through resonances; it is -1 where it falls throughout."""


def can_check(record: Record) -> bool:
    """Tell whether phases are observed, at lines enough."""
    observed = not isinstance(record.experiment.observe, LogAmplitude)
    return observed and record.frequency.size >= FEWEST_LINES


def check(record: Record) -> Iterator[Fault]:
    """Find FRFs without a phase, and those that are complex conjugates.

    Damping is positive, so that exp(i omega t) makes the phase of every mode fall with frequency,
    in all pairs alike, and exp(-i omega t) makes it rise.
    """
    real = [pair for pair in record.pairs if not np.any(np.nan_to_num(record.frf[pair]).imag)]
    if real:
        yield record.fault(
            real[0],
            0.0,
            0.0,
            f"{_whose(record, real)} have no imaginary part at any line, as of amplitudes, "
            "decibels or real parts that were taken for complex FRFs; the phase is needed, since a "
            "damped structure turns it: give real and imaginary parts, or amplitudes and phases, "
            "or observe=observe.LogAmplitude().",
        )
    conjugated = rising(record)
    if conjugated:
        yield record.fault(
            conjugated[0],
            phase_trend(record.frf[conjugated[0]]),
            WRONG_WAY,
            f"{_whose(record, conjugated)} have a phase that rises through resonances, where "
            "that of a damped structure falls, as of FRFs for exp(-i omega t); those for "
            "exp(i omega t) are needed: give their complex conjugates, frf.conj(), or convention "
            '= "exp(-i w t)" in a mapping.',
        )


def rising(record: Record) -> list[Pair]:
    """Pairs whose phase rises through resonances, where it falls in all draws of the model."""
    pairs = [pair for pair in record.pairs if phase_trend(record.frf[pair]) > WRONG_WAY]
    if not pairs:
        return []
    lines = record.frequency > 0
    nominal, draws = prior_responses(record, record.frequency[lines])
    return [
        pair
        for pair in pairs
        if all(phase_trend(response[pair]) < -WRONG_WAY for response in [nominal, *draws])
    ]


def phase_trend(frf: ComplexSpectrum) -> float:
    """Trend of the phase from line to line, 1 where it rises and -1 where it falls throughout.

    Steps are weighed by the amplitudes at both of their ends, so that resonances decide and
    antiresonances, where the phase may rise, do not.
    """
    steps = np.nan_to_num(np.conj(frf[:-1]) * frf[1:]).imag
    return float(steps.sum() / max(np.abs(steps).sum(), np.finfo(float).tiny))


def _whose(record: Record, pairs: list[Pair]) -> str:
    count = len(list(record.pairs))
    where = "All FRFs" if len(pairs) == count else f"{len(pairs)} of {count} FRFs"
    return f"{where} (first {record.label(pairs[0])})"
