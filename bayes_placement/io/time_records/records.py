"""Force and responses as they were recorded, checked, and the rate at which they were sampled."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ..._shared.arguments import check_annotated, check_kind, finite_number, shown
from ..._shared.errors import InputError
from ...positions.channel import Channel, Channels, check_distinct, parsed

FEWEST_SAMPLES = 16
"""Fewest samples of a record of which lines can be had."""

Samples = Float[np.ndarray, "_"]
"""Samples of one record; others may be of another length."""


@dataclass(frozen=True)
class Records:
    """Records of one force [N] and of the motion that answers, in SI, at a sampling rate [Hz].

    `ranges` are the greatest values that channels can record, by their labels.
    """

    rate: float
    force: tuple[Samples, ...]
    response: tuple[tuple[Samples, ...], ...]
    sensors: tuple[Channel, ...]
    actuator: Channel
    ranges: Mapping[str, float]

    def channels(self, record: int) -> dict[str, Samples]:
        """Samples of every channel in one record, the force first, by label."""
        responses = {
            sensor.label: rows[record]
            for sensor, rows in zip(self.sensors, self.response, strict=True)
        }
        return {self.actuator.label: self.force[record], **responses}


def records(
    force: object,
    response: object,
    rate: float | int,
    *,
    sensors: Channels | None,
    actuator: str | Channel,
    ranges: Mapping[str, float | int] | None,
) -> Records:
    """Check what was given and lay it out by channel and record."""
    if isinstance(response, Mapping) and sensors is None:
        sensors, response = [*response], [*response.values()]
    if sensors is None:
        raise InputError(
            "The responses were given without names; a sensor label is needed for each, since "
            "channels are matched by name: sensors=['s1', 's2'], or response={'s1': ..., 's2': "
            "...}."
        )
    rows = parsed(sensors)
    check_distinct("sensor", rows)
    forces = _of_channel("force", force)
    responses = tuple(
        _of_channel(f"response of {sensor.label}", values)
        for sensor, values in zip(rows, _by_sensor(response, len(rows), force), strict=True)
    )
    for sensor, motion in zip(rows, responses, strict=True):
        _check_lengths(sensor.label, motion, forces)
    column = Channel.parse(actuator)
    limits = _ranges(ranges, {column.label, *(sensor.label for sensor in rows)})
    number = positive("rate", rate, "rate=4096.0")
    _check_copies(forces, responses)
    return Records(number, forces, responses, rows, column, limits)


def positive(argument: str, value: object, instead: str) -> float:
    """Return a finite number above zero."""
    number = finite_number(argument, value, instead)
    if not number > 0:
        raise InputError(
            f"{argument}={number:g} was given; a number above 0 is needed, in SI units: {instead}."
        )
    return number


def _by_sensor(response: Any, count: int, force: object) -> Sequence[object]:
    """Responses of each sensor; those of a single one may come as the force does."""
    if count == 1 and _depth(response) == _depth(force):
        return [response]
    check_annotated("response", response, Sequence[object])
    if len(response) != count:
        raise InputError(
            f"The responses have {len(response)} rows for {count} sensor channels; one row for "
            "each is needed, of the same form as the force: response={'s1': ..., 's2': ...}."
        )
    return list(response)


def _depth(values: Any) -> int:
    """Number of axes: of an array, or of arrays in sequences that need not be equally long."""
    if not isinstance(values, list | tuple):
        return np.ndim(values)
    nested = bool(values) and isinstance(values[0], list | tuple | np.ndarray)
    return 1 + (_depth(values[0]) if nested else 0)


def _of_channel(what: str, values: Any) -> tuple[Samples, ...]:
    """Records of a channel: a single one, or the rows of an array or of a sequence."""
    depth = _depth(values)
    if depth not in (1, 2):
        raise InputError(
            f"The {what} was given as {shown(values)} of {depth} axes; the samples of one record, "
            "or a sequence of records is needed, since repeats are counted: force=[hit1, hit2]."
        )
    rows = [values] if depth == 1 else list(values)
    if not rows:
        raise InputError(
            f"The {what} has no record; at least one is needed, since FRFs are estimated from "
            "records: force=[hit1, hit2]."
        )
    return tuple(_samples(what, row) for row in rows)


def _samples(what: str, row: object) -> Samples:
    array = np.asarray(row)
    if array.dtype.kind not in "iuf" or array.ndim != 1 or array.size < FEWEST_SAMPLES:
        raise InputError(
            f"A record of the {what} is {shown(row)} of shape {array.shape} and {array.dtype}; at "
            f"least {FEWEST_SAMPLES} real numbers in a row are needed, since it is transformed to "
            "lines: np.asarray(record, dtype=float)."
        )
    samples = array.astype(float)
    wrong = np.flatnonzero(~np.isfinite(samples))
    if wrong.size:
        raise InputError(
            f"Sample {wrong[0]} of the {what} is {samples[wrong[0]]:g}; finite samples are needed, "
            "since a gap spoils every line of its record. Leave the record out."
        )
    return samples


def _check_lengths(label: str, motion: Sequence[Samples], forces: Sequence[Samples]) -> None:
    if len(motion) != len(forces):
        raise InputError(
            f"{label} has {len(motion)} records and the force has {len(forces)}; one for each is "
            "needed, since each response belongs to a force. Leave out what has no partner."
        )
    for number, (row, force) in enumerate(zip(motion, forces, strict=True), 1):
        if row.size != force.size:
            raise InputError(
                f"Record {number} of {label} has {row.size} samples and its force {force.size}; "
                "the same samples of both are needed, since they are compared in time. Cut both "
                "to the same start and length."
            )


def _check_copies(forces: Sequence[Samples], responses: Sequence[Sequence[Samples]]) -> None:
    """Refuse a record that was given twice."""
    for first, second in combinations(range(len(forces)), 2):
        if all(np.array_equal(rows[first], rows[second]) for rows in (forces, *responses)):
            raise InputError(
                f"Records {first + 1} and {second + 1} are equal in all samples of all channels; "
                "each record is needed once, since a copy counts as a repeat that agrees, and "
                "makes the variance too small. Leave it out."
            )


def _ranges(ranges: Mapping[str, float | int] | None, labels: set[str]) -> dict[str, float]:
    needed = "the greatest value by channel is needed, since each channel has its own"
    instead = "ranges={'hammer': 500.0, 's1': 490.0}"
    check_kind("ranges", ranges, (Mapping, type(None)), needed, instead)
    limits = dict(ranges or {})
    unknown = sorted(set(limits) - labels)
    if unknown:
        raise InputError(
            f"ranges names {unknown[0]!r}, which is no channel; one of {', '.join(sorted(labels))} "
            "is needed, since a range belongs to a channel."
        )
    return {
        label: positive(f"ranges[{label!r}]", limit, "ranges={'s1': 490.0}")
        for label, limit in limits.items()
    }


class Sampled(NamedTuple):
    """Channels by name: samples in units of the file, rates [Hz], what was left out."""

    arrays: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    rates: Mapping[str, float]
    left_out: Mapping[str, str] = MappingProxyType({})


RATES = 1e-4
"""Relative difference of sampling rates that are one."""

JITTER = 0.1
"""Share of the sampling interval by which a time may be off, being rounded."""


def same_rate(first: float, second: float) -> bool:
    """Tell whether two sampling rates [Hz] are one."""
    return abs(first - second) <= RATES * first


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
