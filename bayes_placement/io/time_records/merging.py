"""Measurements of other places on the same lines, such as those of a roving hammer, as one."""

from collections.abc import Sequence

import numpy as np

from ..._shared.arguments import check_annotated, check_kind
from ..._shared.errors import InputError
from ...experiment.measurement import Measurement, Position
from ...positions.channel import Channel

Pair = tuple[tuple[str, int], tuple[str, int]]
"""Name and axis of a sensor channel and of an actuator channel."""


def merged(measurements: Sequence[Measurement]) -> Measurement:
    """Join measurements of other pairs of sensors and actuators on the same lines.

    Pairs that none of them holds are not measured. The number of averages is kept where all have
    the same. Otherwise the variance states what coherence and averages of each stated, for
    `noise.FromVariance`.

    Parameters
    ----------
    measurements
        Those of each place of the hammer, or of the sensors.

    Raises
    ------
    InputError
        If lines, quantities, force levels or positions of a transducer differ, or two hold the same
        pair.

    Examples
    --------
    >>> channels = {"sensors": ["s1"], "actuators": ["a2"], "quantity": "mobility"}
    >>> other = bp.Measurement.from_arrays(measured.frf, measured.frequency, **channels)
    >>> [channel.name for channel in bp.time_records.merged([measured, other]).actuators]
    ['a1', 'a2']
    """
    check_annotated("measurements", measurements, Sequence[object])
    runs = list(measurements)
    needed = "measurements on the same lines are needed, since they become one"
    for run in runs:
        check_kind("measurements", run, Measurement, needed, "merged([first, second])")
    if not runs:
        raise InputError(f"No measurement was given; {needed}: merged([first, second]).")
    first = runs[0]
    for run in runs[1:]:
        _check_alike(first, run)
    sensors = list(dict.fromkeys(channel for run in runs for channel in run.sensors))
    actuators = list(dict.fromkeys(channel for run in runs for channel in run.actuators))
    _check_distinct(runs)
    averages = {run.averages for run in runs}
    variances = [run.variance if len(averages) == 1 else _variance(run) for run in runs]
    places = [_places(run, sensors, actuators) for run in runs]
    shape = len(sensors), len(actuators), first.frequency.size
    return Measurement(
        frf=_filled([run.frf for run in runs], places, shape, complex),
        frequency=first.frequency,
        sensors=tuple(sensors),
        actuators=tuple(actuators),
        quantity=first.quantity,
        coherence=_known([run.coherence for run in runs], places, shape),
        averages=averages.pop() if len(averages) == 1 else None,
        positions=_positions(runs),
        force_level=first.force_level,
        variance=_known(variances, places, shape),
    )


def _variance(run: Measurement) -> np.ndarray | None:
    """Variance of each line as stated, else by coherence and averages; None without them."""
    if run.variance is not None or run.coherence is None or run.averages is None:
        return run.variance
    return run.noise_variance()


def _positions(runs: Sequence[Measurement]) -> dict[str, Position]:
    """Recorded positions [m] of all transducers."""
    positions: dict[str, Position] = {}
    for name, place in (pair for run in runs for pair in run.positions.items()):
        if positions.setdefault(name, place) != place:
            raise InputError(
                f"{name} was recorded at {positions[name]} m and at {place} m; a transducer has "
                "one position in a measurement, since it is known by its name. Name it anew at "
                "each place: sensors=['s1', 's2']."
            )
    return positions


def _places(
    run: Measurement, sensors: list[Channel], actuators: list[Channel]
) -> tuple[np.ndarray, ...]:
    """Rows and columns of a measurement among all, as an index of its block."""
    rows = [sensors.index(channel) for channel in run.sensors]
    return np.ix_(rows, [actuators.index(channel) for channel in run.actuators])


def _known(
    values: Sequence[np.ndarray | None],
    places: list[tuple[np.ndarray, ...]],
    shape: tuple[int, int, int],
) -> np.ndarray | None:
    """What is known of each line in one array; None where none knows it."""
    if all(array is None for array in values):
        return None
    return _filled(values, places, shape, float)


def _filled(
    values: Sequence[np.ndarray | None],
    places: list[tuple[np.ndarray, ...]],
    shape: tuple[int, int, int],
    dtype: type,
) -> np.ndarray:
    """Blocks of measurements in one array, NaN elsewhere."""
    result: np.ndarray = np.full(shape, np.nan, dtype)
    for array, block in zip(values, places, strict=True):
        if array is not None:
            result[block] = np.where(np.isnan(array), result[block], array)
    return result


def _check_alike(first: Measurement, run: Measurement) -> None:
    if run.quantity != first.quantity:
        raise InputError(
            f"Measurements of {first.quantity} and of {run.quantity} were given; one quantity is "
            f"needed, since a measurement has one: measurement.converted({first.quantity!r})."
        )
    if not np.array_equal(run.frequency, first.frequency):
        raise InputError(
            f"Measurements of {first.frequency.size} and {run.frequency.size} lines were given, or "
            "of other ones; the same lines are needed, since FRFs are not interpolated across "
            "resonances. Take common ones first: measurement.lines(frequency)."
        )
    if run.force_level != first.force_level:
        levels = " and ".join(f"{level} N" for level in (first.force_level, run.force_level))
        raise InputError(
            f"Measurements at a force of {levels} were given; one level is needed, since a "
            "measurement has one. Keep levels apart, Experiment(..., force_levels=[1.0, 5.0]), or "
            "state none for a linear structure: dataclasses.replace(measurement, force_level=None)."
        )


def _check_distinct(runs: Sequence[Measurement]) -> None:
    """Refuse a pair that two of them hold, in the same or in opposite directions."""
    earlier: set[Pair] = set()
    for run in runs:
        pairs = _pairs(run)
        repeated = [label for pair, label in pairs.items() if pair in earlier]
        if repeated:
            raise InputError(
                f"{repeated[0]} is in two of the measurements; each pair is needed once, since its "
                "data would count twice. Estimate repeats of a pair together: "
                "time_records.frf(force=[...], response=[...])."
            )
        earlier |= pairs.keys()


def _pairs(run: Measurement) -> dict[Pair, str]:
    """Labels of the pairs that were measured, by names and axes."""
    measured = [
        (run.sensors[row], run.actuators[column])
        for row, column in np.argwhere(run.measured).tolist()
    ]
    return {
        ((sensor.name, abs(sensor.direction)), (actuator.name, abs(actuator.direction))): (
            f"{sensor.label} / {actuator.label}"
        )
        for sensor, actuator in measured
    }
