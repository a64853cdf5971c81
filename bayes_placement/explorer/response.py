"""Response of a model at values of its unknowns, compiled once for each structure of effects."""

from collections.abc import Callable, Mapping
from typing import Generic, NamedTuple, TypeAlias, TypeVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._shared.compiled import Bound, compiled, of_jax, programs_kept
from .._shared.files import Json
from ..criticism.fitted import prediction, with_arrays
from ..effects.effect import Effect
from ..experiment._experiment_checks import at_levels
from ..experiment.experiment import Experiment, Measurements
from ..experiment.noise import Data
from ..inference.output_residuals import standardised_residual
from ..positions.places import coordinates

Made = TypeVar("Made")

MOST = 12
"""Most experiments for which it stays; undo and redo among them are quick."""


class LastUsed(Generic[Made]):
    """What `make` makes of an experiment, made once while the experiment is among the last used."""

    def __init__(self, make: Callable[[Experiment], Made]):
        self._make = make
        self._kept: list[tuple[Experiment, Made]] = []

    def __call__(self, experiment: Experiment) -> Made:
        """Return what is made of an experiment, which is told by its identity."""
        known = [made for other, made in self._kept if other is experiment]
        made = known[0] if known else self._make(experiment)
        others = [kept for kept in self._kept if kept[0] is not experiment]
        self._kept = [*others, (experiment, made)][-MOST:]
        return made


BANDS = 32
"""Most frequency bands of the map of the error."""

PROGRAMS = programs_kept(MOST)
"""Compiled responses; each structure of effects that is tried has one of some MB."""

Values = Mapping[str, float]
"""Value of each unknown by name, elements of arrays one by one."""

Outputs: TypeAlias = tuple[Array, Array, Array, Float[Array, "item 3"]]


class Response(NamedTuple):
    """What a model predicts with values of its unknowns, and how far it is off."""

    predicted: Float[np.ndarray, "pair part line"]
    deviation: Float[np.ndarray, "pair part line"]
    """Outputs [pair, part, line] and the standard deviation of the noise of each."""
    residual: Float[np.ndarray, "pair part line"]
    """Errors over these deviations; NaN where nothing was measured."""
    places: Float[np.ndarray, "item 3"]
    """Where sensors, actuators and effects are [item, 3] [m], NaN where that means nothing."""

    @property
    def chi2(self) -> float:
        """Mean square of the residuals, the reduced chi-square."""
        return float(np.nanmean(self.residual**2))

    @property
    def chi2_of_pairs(self) -> Float[np.ndarray, "pair"]:
        """The same of each pair of channels; NaN where nothing was measured."""
        return _mean(self.residual**2, (1, 2))

    @property
    def error(self) -> Float[np.ndarray, "pair line"]:
        """Root mean square of the residuals over real and imaginary part, line by line."""
        return np.sqrt(_mean(self.residual**2, (1,)))

    def chi2_of_bands(self) -> Float[np.ndarray, "pair band"]:
        """Mean square of the residuals of each pair in bands of as many lines each."""
        lines = self.residual.shape[-1]
        parts = np.array_split(self.residual**2, min(BANDS, lines), axis=-1)
        return np.stack([_mean(part, (1, 2)) for part in parts], axis=-1)


class ResponseOf:
    """Responses of an experiment to what was measured, one call for each set of values."""

    def __init__(self, experiment: Experiment, data: Data):
        self._experiment, self._data = experiment, data
        known = of_jax(experiment), of_jax(data)
        self._compiled: Bound[Outputs] = compiled(_response).bound(*known, programs=PROGRAMS)
        self._present = _rows(np.asarray(data.measured), experiment)

    def __call__(self, values: Values) -> Response:
        """Return the response at values."""
        arrays = {
            name: np.asarray(value, dtype=float) if np.asarray(value).dtype.kind == "f" else value
            for name, value in with_arrays(self._experiment, values).items()
        }
        predicted, variance, residual, places = map(np.asarray, self._compiled(arrays))
        rows = (_rows(part, self._experiment) for part in (predicted, variance, residual))
        outputs, variances, residuals = rows
        kept = np.where(self._present, residuals, np.nan)
        return Response(outputs, np.sqrt(variances), kept, places)


def measured_rows(experiment: Experiment, data: Data) -> Float[np.ndarray, "pair part line"]:
    """Measured outputs by pair and part; NaN where there are none."""
    return _rows(np.where(data.measured, np.asarray(data.z), np.nan), experiment)


def coherence_rows(
    experiment: Experiment, measurement: Measurements
) -> Float[np.ndarray, "pair line"] | None:
    """Coherence of each pair, line by line; None where it was not measured."""
    channels = experiment.sensor_channels, experiment.actuator_channels
    lines = np.asarray(experiment.frequency)
    runs = [
        run.lines(lines).channels(*channels).coherence
        for run in at_levels(measurement, experiment.force_levels)
    ]
    known = [coherence for coherence in runs if coherence is not None]
    if len(known) < len(runs):
        return None
    return np.stack(known, axis=2).reshape(-1, lines.size)


def pair_labels(experiment: Experiment) -> list[Json]:
    """Sensor, actuator and force level [N] of each pair, in the order of the rows."""
    observe = experiment.observe
    return [
        {"sensor": sensor, "actuator": actuator, "level": level}
        for sensor in observe.rows(experiment.sensor_channels)
        for actuator in observe.columns(experiment.actuator_channels)
        for level in experiment.force_levels or (None,)
    ]


def items_of(experiment: Experiment) -> list[tuple[str, str]]:
    """Kind and name of what has a place: sensors, actuators, and effects that are somewhere."""
    placed = [("effect", effect.name) for effect in experiment.effects if is_placed(effect)]
    sensors = [("sensor", name) for name in experiment.sensor]
    return [*sensors, *(("actuator", name) for name in experiment.actuator), *placed]


def _response(experiment: Experiment, data: Data, values: Mapping[str, object]) -> Outputs:
    known = experiment.fix(values)
    predicted, variance = prediction(known, data)
    residual, _ = standardised_residual(known, data, False)
    return predicted, variance, residual.reshape(predicted.shape), _places(known)


def _places(known: Experiment) -> Float[Array, "item 3"]:
    instruments = [*known.sensor.values(), *known.actuator.values()]
    where: list[object] = [transducer.position for transducer in instruments]
    where += [getattr(e, e.place_fields[0]) for e in known.effects if is_placed(e)]
    three = [jnp.ravel(coordinates(at)) for at in where]
    return jnp.stack([jnp.pad(at, (0, 3 - at.size)) for at in three])


def is_placed(effect: Effect) -> bool:
    """Whether an effect has a place of its own, rather than a shift or a part."""
    return effect.place_fields[:1] == ("at",)


def _rows(outputs: np.ndarray, experiment: Experiment) -> np.ndarray:
    """Outputs [pair, part, line]; those without parts have one."""
    parts = experiment.observe.parts
    return outputs.reshape(-1, parts, outputs.shape[-1])


def _mean(squares: np.ndarray, axes: tuple[int, ...]) -> np.ndarray:
    """Mean of what was measured; NaN where nothing was."""
    count = np.isfinite(squares).sum(axis=axes)
    return np.nansum(squares, axis=axes) / np.where(count, count, np.nan)
