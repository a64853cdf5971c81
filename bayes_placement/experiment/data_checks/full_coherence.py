"""Coherence of 1 everywhere, as one average gives it: it says nothing of the noise."""

from collections.abc import Iterator

import numpy as np

from .record import Fault, Pair, Record

ROUNDING = 1e-9
"""Distance from 1 within which a coherence is 1."""

SHARE = 0.95
"""Share of lines from which on a coherence is 1 everywhere."""


def can_check(record: Record) -> bool:
    """Tell whether there is a coherence."""
    coherence = record.measurement.coherence
    return coherence is not None and bool(np.isfinite(coherence).any())


def check(record: Record) -> Iterator[Fault]:
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
