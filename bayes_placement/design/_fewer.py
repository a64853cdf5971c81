"""_fewer: in, an experiment; out, the experiment with fewer transducers or lines, or more sensors.

Not known here: where transducers are tried, what is learnt.
"""

import dataclasses
import itertools
from collections import OrderedDict
from collections.abc import Collection, Mapping
from typing import Any

import equinox as eqx
import numpy as np

from .._types import InputError
from ..experiment.experiment import Experiment
from ..experiment.noise import Covariance, Gaussian, Noise
from ..experiment.transducers import Sensor


def with_only(experiment: Experiment, names: Collection[str]) -> Experiment:
    """Return the experiment with some of its transducers, and the noise of their channels.

    Raises
    ------
    ValueError
        If one that is left out may be what an effect on the instruments is about.
    """
    kept = [_kept(side, names) for side in (experiment.sensor, experiment.actuator)]
    if kept == [experiment.sensor, experiment.actuator]:
        return experiment
    _check_instrument_effects(experiment)
    noise = experiment.noise
    if noise is not None:
        channels = (_channels(side, names) for side in (experiment.sensor, experiment.actuator))
        noise = noise.of(*channels)
    return eqx.tree_at(
        lambda tree: (tree.sensor, tree.actuator, tree.noise),
        experiment,
        (*kept, noise),
        is_leaf=lambda leaf: leaf is None or isinstance(leaf, dict),
    )


def with_more(experiment: Experiment, count: int) -> Experiment:
    """Return the experiment with so many more sensors like its last one, `s1`, `s2` and so on.

    Raises
    ------
    ValueError
        If each channel has a level of the output error of its own.
    """
    last = list(experiment.sensor.values())[-1]
    noise = experiment.noise
    if noise is not None and not _equal(noise, noise.of(sensors=np.array([0]))):
        raise InputError(
            f'{count} more sensors like "{last.name}" were asked for, but each channel has a level '
            "of the output error of its own, so theirs is not known. Declare all sensors in the "
            "experiment."
        )
    names = (f"s{number}" for number in itertools.count(1))
    free = (name for name in names if name not in {*experiment.sensor, *experiment.actuator})
    more = [_alike(last, next(free)).on(experiment.structure.modes) for _ in range(count)]
    sensors = OrderedDict(experiment.sensor) | {one.name: one for one in more}
    return eqx.tree_at(
        lambda tree: tree.sensor,
        experiment,
        OrderedDict(sensors),
        is_leaf=lambda leaf: isinstance(leaf, dict),
    )


def _alike(one: Sensor, name: str) -> Sensor:
    at: Any = one.recorded if one.support is None else one.support
    return Sensor(name, at=at, directions=one.directions, angles=one.angles)  # type: ignore[call-arg]


def with_lines(experiment: Experiment, count: int) -> Experiment:
    """Return the experiment with so many of its lines at most, evenly spread, and their noise.

    Parameters
    ----------
    experiment
        The experiment; the level of its output error is no distribution.
    count
        Lines, one at least.
    """
    every = np.asarray(experiment.frequency)
    if every.size <= count:
        return experiment
    kept = ((np.arange(count) + 0.5) * every.size / count).astype(int)
    levels = np.arange(len(experiment.force_levels or (1,)))
    data = (every.size * levels[:, None] + kept).ravel()
    noise = _at_data(experiment.noise, data, every.size * levels.size)
    return eqx.tree_at(
        lambda tree: (tree.frequency, tree.noise),
        experiment,
        (every[kept], noise),
        is_leaf=lambda leaf: leaf is None,
    )


def _at_data(noise: Noise | None, kept: np.ndarray, size: int) -> Noise | None:
    """Noise of some data along frequency, of so many in all."""
    if isinstance(noise, Covariance):
        return Covariance(np.asarray(noise.matrix)[np.ix_(kept, kept)], noise.scale)
    if isinstance(noise, Gaussian) and np.shape(noise.sigma)[-1:] == (size,):
        return Gaussian(np.asarray(noise.sigma)[..., kept])
    return noise


def is_measurable(experiment: Experiment, names: Collection[str]) -> bool:
    """Tell whether a sensor and an actuator are among the names."""
    sides = (experiment.sensor, experiment.actuator)
    return all(any(name in names for name in side) for side in sides)


def alike(experiment: Experiment, one: str, other: str) -> bool:
    """Tell whether two transducers differ in their name and place only."""
    for side, word in ((experiment.sensor, "sensors"), (experiment.actuator, "actuators")):
        if one in side and other in side:
            noise = experiment.noise
            levels = [noise and noise.of(**{word: _channels(side, {n})}) for n in (one, other)]
            fields = [(side[name].directions, side[name].angles) for name in (one, other)]
            return not experiment.instrument_effects and _equal(*levels) and _equal(*fields)
    return False


def _equal(one: Any, other: Any) -> bool:
    return bool(eqx.tree_equal(one, other))


def _kept(side: Mapping[str, Any], names: Collection[str]) -> OrderedDict[str, Any]:
    return OrderedDict((name, one) for name, one in side.items() if name in names)


def _channels(side: Mapping[str, Any], names: Collection[str]) -> np.ndarray:
    """Numbers of the channels of some transducers."""
    owners = [name for name, one in side.items() for _ in one.channels]
    return np.flatnonzero([owner in names for owner in owners])


def _check_instrument_effects(experiment: Experiment) -> None:
    for effect in experiment.instrument_effects.values():
        if "sensor" in {field.name for field in dataclasses.fields(effect)}:
            raise InputError(
                f'The effect "{effect.name}" is about one sensor, by its number, but sensors are '
                "to be left out here, which changes the numbers. Leave the effect out: "
                f'experiment.without("{effect.name}").'
            )
