"""The experiment with fewer transducers or lines, with more sensors, or of modes, and its noise."""

import dataclasses
import itertools
from collections import OrderedDict
from collections.abc import Collection, Mapping

import equinox as eqx
import numpy as np

from .._shared.arguments import arguments_checked
from .._shared.errors import InputError
from .._shared.sites import is_unknown
from ._errors_of_parts import OF_WHAT
from .experiment import Experiment
from .measurement import Measurement
from .modal_parameters import ModalParameters
from .model_error import Embedded
from .noise import Covariance, FromVariance, Gaussian, Noise
from .observe import ModalData
from .structure import is_dict
from .transducers import Sensor, Transducer


def with_only(
    experiment: Experiment,
    *,
    sensors: Collection[str] | None = None,
    actuators: Collection[str] | None = None,
) -> Experiment:
    """Return the experiment with some of its transducers, and the noise of their channels.

    Names that it does not have are ignored; without names all of a side remain.
    """
    requests = ((experiment.sensor, sensors), (experiment.actuator, actuators))
    if all(names is None or set(side) <= set(names) for side, names in requests):
        return experiment
    _refuse_numbered_sensors(experiment)
    remaining = [
        OrderedDict((name, side[name]) for name in side if names is None or name in names)
        for side, names in requests
    ]
    noise = experiment.noise
    if noise is not None:
        chosen = [
            slice(None) if names is None else channel_numbers(side, names)
            for side, names in requests
        ]
        noise = noise.of(*chosen)
    return eqx.tree_at(
        lambda tree: (tree.sensor, tree.actuator, tree.noise),
        experiment,
        (*remaining, noise),
        is_leaf=lambda leaf: leaf is None or isinstance(leaf, dict),
    )


def with_more_sensors(experiment: Experiment, count: int) -> Experiment:
    """Return the experiment with `count` more sensors like its last one, `s1`, `s2` and so on."""
    last = list(experiment.sensor.values())[-1]
    noise = experiment.noise
    if noise is not None and not eqx.tree_equal(noise, noise.of(sensors=np.array([0]))):
        raise InputError(
            f'{count} more sensors like "{last.name}" were asked for, but each channel has its '
            "own level of the output error, so that of a new sensor is not known. Declare all "
            "sensors in the experiment."
        )
    names = (f"s{number}" for number in itertools.count(1))
    free = (name for name in names if name not in {*experiment.sensor, *experiment.actuator})
    sensors = OrderedDict(experiment.sensor)
    for name in itertools.islice(free, count):
        sensors[name] = _like(last, name).on(experiment.structure.modes)
    return eqx.tree_at(lambda tree: tree.sensor, experiment, sensors, is_leaf=is_dict)


def _like(sensor: Sensor, name: str) -> Sensor:
    return sensor.like(name, sensor.recorded if sensor.tolerance is None else sensor.tolerance)


def with_lines(experiment: Experiment, count: int) -> Experiment:
    """Return the experiment with at most `count` of its lines, evenly spread, and their noise."""
    size = np.size(experiment.frequency)
    if size <= count:
        return experiment
    return with_lines_at(experiment, evenly_spread(size, count))


def evenly_spread(size: int, count: int) -> np.ndarray:
    """Return `count` of the numbers from 0 to `size` - 1, in the middle of parts of one length."""
    return ((np.arange(count) + 0.5) * size / count).astype(int)


def with_lines_at(experiment: Experiment, chosen: np.ndarray) -> Experiment:
    """Return the experiment with some of its lines, by their numbers, and their noise."""
    lines = np.asarray(experiment.frequency)
    noise = _noise_at(experiment.noise, chosen, lines.size)
    return eqx.tree_at(
        lambda tree: (tree.frequency, tree.noise),
        experiment,
        (lines[chosen], noise),
        is_leaf=lambda leaf: leaf is None,
    )


def with_effects_roughly(experiment: Experiment) -> Experiment:
    """Return the experiment with effects of its structure in a form that takes less time."""
    effects = experiment.structure.effects
    rough = type(effects)((name, effect.roughly()) for name, effect in effects.items())
    return eqx.tree_at(lambda tree: tree.structure.effects, experiment, rough)


def _noise_at(noise: Noise | None, chosen: np.ndarray, size: int) -> Noise | None:
    """Noise of the chosen ones of `size` lines."""
    if isinstance(noise, Covariance):
        return Covariance(np.asarray(noise.matrix)[np.ix_(chosen, chosen)], noise.factor)
    if not isinstance(noise, Gaussian) or is_unknown(noise.sigma):
        return noise
    sigma = np.asarray(noise.sigma)
    return Gaussian(sigma[..., chosen]) if sigma.shape[-1:] == (size,) else noise


def as_measured(experiment: Experiment, measurement: Measurement | ModalParameters) -> Experiment:
    """Return the experiment with the lines and transducers of a measurement, within its band.

    One that observes modes observes those of the measurement instead, model error included: the
    lowest of them, as many as have errors there. Sensors of which it has no shape are left out. Its
    noise must not be stated line by line. The measurement may have any lines and some of the
    channels, or other modes.
    """
    if isinstance(measurement, ModalParameters):
        return _of_other_modes(experiment, measurement)
    lines, band = np.asarray(measurement.frequency), np.asarray(experiment.frequency)
    margin = 1e-9 * float(band.max())
    inside = lines[(lines >= band.min() - margin) & (lines <= band.max() + margin)]
    names = {
        "sensors": [channel.name for channel in measurement.sensors],
        "actuators": [channel.name for channel in measurement.actuators],
    }
    shared = (set(names["sensors"]) & set(experiment.sensor)) and (
        set(names["actuators"]) & set(experiment.actuator)
    )
    if not inside.size or not shared:
        raise InputError(
            "The baseline shares no line, no sensor or no actuator with the experiment, so that "
            "nothing of it can be compared. It needs lines between "
            f"{band.min():g} and {band.max():g} Hz, one of the sensors "
            f"{', '.join(experiment.sensor)} and one of the actuators "
            f"{', '.join(experiment.actuator)}."
        )
    fewer = with_only(experiment, **names)
    if np.array_equal(inside, band):
        return fewer
    return eqx.tree_at(lambda tree: tree.frequency, fewer, inside)


def _of_other_modes(experiment: Experiment, measured: ModalParameters) -> Experiment:
    """The experiment of other modes of the same structure."""
    shared = [channel for channel in measured.sensors if channel.name in experiment.sensor]
    fewer = with_only(experiment, sensors={channel.name for channel in shared})
    observe = ModalData(_with_errors(experiment, measured)).on(fewer.sensor_channels)
    return eqx.tree_at(
        lambda tree: (tree.observe, tree.frequency), fewer, (observe, observe.lines(None))
    )


def _with_errors(experiment: Experiment, measured: ModalParameters) -> ModalParameters:
    """The lowest modes, those of which the experiment has errors; all where it is exact."""
    count = measured.natural_frequency.size
    if experiment.model_error is None:
        return measured
    number = np.arange(1, count + 1) if measured.number is None else np.array(measured.number)
    erroneous = np.flatnonzero(number <= experiment.model_error.modes)
    if not erroneous.size:
        raise InputError(
            f"The baseline has the modes {', '.join(map(str, number))}, and the model has errors "
            f"of the first {experiment.model_error.modes}; a mode of both states is needed, since "
            "what the model does not know cancels between them. Give modes that both have."
        )
    return measured.modes(erroneous.tolist())


@arguments_checked
def observing_modes(experiment: Experiment, measured: ModalParameters) -> Experiment:
    """Return the experiment as one that observes modal parameters: without actuators and lines.

    Sensors of which no shape was measured are left out, and so are effects that modes do not show.
    Shapes at other sensors than those of the experiment are not used.

    Parameters
    ----------
    experiment
        The experiment, whose sensors have the names of those of the shapes.
    measured
        Natural frequencies [Hz], damping ratios [1] and shapes, as `bp.identify` returns them.

    Returns
    -------
    Experiment
        Its structure and sensors, observed by `observe.ModalData(measured)`, the noise being
        theirs.

    Raises
    ------
    InputError
        If no sensor of the shapes has the name of one of the experiment.

    Examples
    --------
    >>> bp.observing_modes(experiment, bp.ModalParameters([160.0], [0.1], number=[1]))
    Experiment: 1 modes from 160 to 160 Hz, shapes at 0 sensor channels, z = natural frequency [Hz],
    damping ratio [1], shape [as measured]
    """
    names = dict.fromkeys(channel.name for channel in measured.sensors)
    sensors = [sensor for name, sensor in experiment.sensor.items() if name in names]
    if names and not sensors:
        raise InputError(
            f"Modal parameters have shapes at {', '.join(names)}, but the sensors of the model are "
            f"{', '.join(experiment.sensor) or 'none'}; one name at least must be the same, since "
            'places belong to names. Rename a channel: "shape s1" in a table, an array sensors in '
            'a file of arrays, or names={11: "s1"} for a node or a row of shapes.'
        )
    for effect in experiment.effects:
        if not effect.changes_modes:
            experiment = experiment.without(effect.name)
    if len(sensors) < len(experiment.sensor):
        _refuse_numbered_sensors(experiment)
    modal = Experiment(
        experiment.structure, sensors=sensors, observe=ModalData(measured), noise=FromVariance()
    )
    for effect in experiment.instrument_effects.values():
        modal = modal + effect
    return modal.with_model_error(_model_error_of(experiment))


def _model_error_of(experiment: Experiment) -> Embedded | None:
    """Model error of the sizes that an experiment has; errors from run to run need runs."""
    errors = experiment.model_error
    if errors is None:
        return None
    kinds = {word: getattr(errors, word) for word in OF_WHAT}
    sizes = {word: None if kind is None else kind.size for word, kind in kinds.items()}
    return Embedded(**sizes | {"runs": None})


def channel_numbers(side: Mapping[str, Transducer], names: Collection[str]) -> np.ndarray:
    """Numbers of the channels of some of the sensors, or of the actuators."""
    owners = [name for name, transducer in side.items() for _ in transducer.channels]
    return np.flatnonzero([owner in names for owner in owners])


def _refuse_numbered_sensors(experiment: Experiment) -> None:
    for effect in experiment.instrument_effects.values():
        fields = {field.name for field in dataclasses.fields(effect)}
        if fields & {"sensor", "actuator", "transducer"}:
            raise InputError(
                f'The effect "{effect.name}" is about one sensor, by its number, but sensors are '
                "to be left out, which changes the numbers. Leave the effect out: "
                f'experiment.without("{effect.name}").'
            )
