"""What a record does not tell: a coherence that says nothing, no phase, names that look alike."""

from collections.abc import Iterator

import numpy as np

from ...positions.channel import look_alike
from .._noise_level import FEWEST_LINES
from ..observe import LogAmplitude
from .record import Fault, Pair, Record

ROUNDING = 1e-9
"""Distance from 1 within which a coherence is 1."""

SHARE = 0.95
"""Share of lines from which on a coherence is 1 everywhere."""


def has_coherence(record: Record) -> bool:
    """Tell whether there is a coherence."""
    coherence = record.measurement.coherence
    return coherence is not None and bool(np.isfinite(coherence).any())


def full_coherence(record: Record) -> Iterator[Fault]:
    """Find a coherence of 1: the estimate of one average is 1 whatever the noise is.

    Bendat and Piersol, Random Data, ch. 9.
    """
    coherence = np.asarray(record.measurement.coherence)
    share = np.mean(coherence >= 1 - ROUNDING, axis=-1)
    pairs = [Pair(*map(int, numbers)) for numbers in np.argwhere(share > SHARE)]
    if pairs:
        count = len(list(record.pairs))
        where = "all pairs" if len(pairs) == count else f"{len(pairs)} of {count} pairs"
        yield record.fault(
            pairs[0],
            float(share[pairs[0]]),
            SHARE,
            f"The coherence of {where} (first {record.label(pairs[0])}) is 1 at "
            f"{100 * float(share[pairs[0]]):.0f} % of the lines, which one average gives whatever "
            "the noise is: it says nothing of the noise, so leave it out, coherence=None, and "
            "take noise.Gaussian with an unknown level.",
        )


def observes_phase(record: Record) -> bool:
    """Tell whether phases are observed, at lines enough."""
    observed = not isinstance(record.experiment.observe, LogAmplitude)
    return observed and record.frequency.size >= FEWEST_LINES


def no_phase(record: Record) -> Iterator[Fault]:
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


def has_names_alike(record: Record) -> bool:
    """Tell whether two names of one side look alike; else there is nothing to tell."""
    return any(names_alike(record))


def names_alike(record: Record) -> Iterator[Fault]:
    """Find names of one side that differ in case or in the form of letters alone."""
    for side, channels in enumerate((record.measurement.sensors, record.measurement.actuators)):
        names = [channel.name for channel in channels]
        for number, name in enumerate(names):
            hint = look_alike(name, names[:number]) if name not in names[:number] else ""
            if hint:
                pair = Pair(0, number) if side else Pair(number, 0)
                sentence = (
                    f"Two names are easily confused:{hint} Where they are one transducer, leave "
                    "one of them out; else give them other names."
                )
                yield record.fault(pair, 1.0, 0.0, sentence)
