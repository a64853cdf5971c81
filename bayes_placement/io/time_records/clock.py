"""Channels of time records as readers return them, and their rate: stated, given or from times."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..._shared.errors import InputError
from .recording import same_rate
from .records import positive


class Sampled(NamedTuple):
    """Channels by name: samples in units of the file, rates [Hz], what was left out."""

    arrays: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    rates: Mapping[str, float]
    left_out: Mapping[str, str] = MappingProxyType({})


JITTER = 0.1
"""Share of the sampling interval by which a time may be off, being rounded."""


def rate_of(stated: Iterable[float], rate: float | int | None, *by_times: float) -> float:
    """Return the one sampling rate [Hz] that is stated, given or read from times."""
    rates = list(stated)
    if rate is not None:
        rates.append(positive("rate", rate, "rate=4096.0"))
    rates += by_times
    if not rates:
        raise InputError(
            "The file states no sampling rate; one is needed, since lines are in Hz: rate=4096.0, "
            "or time='t' where it holds the times of its samples."
        )
    for other in rates[1:]:
        if not same_rate(rates[0], other):
            raise InputError(
                f"Sampling rates of {rates[0]:.6g} and {other:.6g} Hz are stated; one is needed, "
                "since all channels are sampled together. Leave rate= out, or export at one rate."
            )
    return rates[0]


def check_starts(starts: Mapping[str, float]) -> None:
    """Refuse channels whose first samples are not at one time [s]."""
    if starts and max(starts.values()) > min(starts.values()):
        late = max(starts, key=lambda name: starts[name])
        early = min(starts, key=lambda name: starts[name])
        raise InputError(
            f"{late!r} begins {starts[late] - starts[early]:.4g} s after {early!r}; one start is "
            "needed, since force and response are compared in time. Export them on one time axis."
        )


def rate_of_times(times: np.ndarray) -> float:
    """Sampling rate [Hz] by the times [s] of the samples."""
    if times.size < 2 or not np.isfinite(times).all() or not times[-1] > times[0]:
        raise InputError(
            f"{times.size} times from {times[0]:g} to {times[-1]:g} s were read; increasing ones "
            "are needed, since the sampling rate follows from them: rate=4096.0 instead."
        )
    interval = float(times[-1] - times[0]) / (times.size - 1)
    off = np.abs(times - times[0] - interval * np.arange(times.size)) / interval
    if off.max() > JITTER:
        worst = int(np.argmax(off))
        raise InputError(
            f"The time of sample {worst + 1} is {times[worst]:g} s, {off[worst]:.2g} intervals off "
            "even spacing; even samples are needed, since a transform takes them as such. Where "
            "times are only rounded give the rate: rate=4096.0, without time=."
        )
    return 1 / interval
