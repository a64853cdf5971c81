"""One run of a measurement in the channels of an experiment, its noise, and what models give."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from ..._shared.compiled import compiled
from ..._shared.dimensions import Receptance
from ...positions.channel import Channel
from ...positions.vectors import Recorded
from .._noise_level import noise_variance
from ..measurement import Measurement
from ..prior_draws import draws_from_priors
from ..quantities import quantity_of

if TYPE_CHECKING:
    from ..experiment import Experiment


PLACE_PRECISION = 1e-3
"""Distance within which two recorded places are one, of the greatest size of the structure."""


DRAWS = 20
"""Draws from the priors: the greatest of a statistic over them is exceeded in 1 of 21 cases."""

Response = Complex[np.ndarray, "sensor actuator frequency"]


class Fault(NamedTuple):
    """A fault of a record."""

    sensor: str
    actuator: str
    """Channels that it was seen in."""
    value: float
    threshold: float
    """The statistic, and what it may be at most."""
    sentence: str
    """What is wrong, and what to do."""


class Pair(NamedTuple):
    """Numbers of a sensor channel and of an actuator channel."""

    sensor: int
    actuator: int


@dataclass(frozen=True)
class Record:
    """One run of a measurement at all its lines, in the channels of an experiment."""

    experiment: "Experiment"
    """The experiment."""
    measurement: Measurement
    """What was measured, with the channels of the experiment."""
    level: int
    """Number of its force level."""

    @property
    def frf(self) -> Complex[np.ndarray, "sensor actuator frequency"]:
        """Measured FRFs; NaN where nothing was measured."""
        return self.measurement.frf

    @property
    def frequency(self) -> Float[np.ndarray, "frequency"]:
        """Lines [Hz]."""
        return self.measurement.frequency

    @property
    def moving(self) -> Bool[np.ndarray, "frequency"]:
        """Which lines are above 0 Hz."""
        return self.frequency > 0

    @property
    def measured(self) -> Bool[np.ndarray, "sensor actuator"]:
        """Which pairs were measured."""
        return self.measurement.measured

    @property
    def pairs(self) -> Iterator[Pair]:
        """Pairs that were measured."""
        return (Pair(*map(int, numbers)) for numbers in np.argwhere(self.measured))

    @cached_property
    def noise_variance(self) -> Float[np.ndarray, "sensor actuator frequency"]:
        """Variance E|error|^2 of each FRF value [unit of the FRF squared]."""
        return noise_variance(self.measurement)

    @cached_property
    def prior_models(self) -> "list[Experiment]":
        """The nominal experiment, and those of draws from the priors."""
        drawn = draws_from_priors(self.experiment.unknowns, 0, DRAWS)
        values = [{name: each[draw] for name, each in drawn.items()} for draw in range(DRAWS)]
        return [self.experiment.fix(one) for one in (self.experiment.nominal_values(), *values)]

    def label(self, pair: Pair) -> str:
        """Name of a pair: sensor channel / actuator channel."""
        sensor = self.measurement.sensors[pair.sensor].label
        return f"{sensor} / {self.measurement.actuators[pair.actuator].label}"

    def whose(self, pairs: Sequence[Pair]) -> str:
        """Say how many of the FRFs some pairs are, and which is the first."""
        count = len(list(self.pairs))
        where = "All FRFs" if len(pairs) == count else f"{len(pairs)} of {count} FRFs"
        return f"{where} (first {self.label(pairs[0])})"

    def fault(self, pair: Pair, value: float, threshold: float, sentence: str) -> Fault:
        """Return a fault that was seen in a pair."""
        sensor = self.measurement.sensors[pair.sensor].label
        actuator = self.measurement.actuators[pair.actuator].label
        return Fault(sensor, actuator, value, threshold, sentence)

    @cached_property
    def driving_points(self) -> dict[Pair, int]:
        """Pairs whose sensor and actuator share place and axis, with the sign between them."""
        sensors, actuators = self.measurement.sensors, self.measurement.actuators
        return {
            Pair(row, column): int(np.sign(sensor.direction * actuator.direction))
            for row, sensor in enumerate(sensors)
            for column, actuator in enumerate(actuators)
            if abs(sensor.direction) == abs(actuator.direction) and self._together(sensor, actuator)
        }

    def _together(self, sensor: Channel, actuator: Channel) -> bool:
        experiment = self.experiment
        apart = _distance(
            experiment.sensor[sensor.name].recorded, experiment.actuator[actuator.name].recorded
        )
        low, high = experiment.structure.modes.bounds()
        return apart <= PLACE_PRECISION * _distance(low, high)

    def exact(self, pair: Pair) -> bool:
        """Tell whether nothing of the placement of a pair is unknown."""
        names = {
            ("sensor", self.measurement.sensors[pair.sensor].name),
            ("actuator", self.measurement.actuators[pair.actuator].name),
        }
        return not any(tuple(unknown.owner) in names for unknown in self.experiment.unknowns)


def _distance(first: Recorded, second: Recorded) -> float:
    return float(np.linalg.norm(np.atleast_1d(first) - np.atleast_1d(second)))


def prior_responses(
    record: Record,
    frequency: Float[np.ndarray, "frequency"],
    models: "Iterable[Experiment] | None" = None,
) -> tuple[Response, Sequence[Response]]:
    """FRFs of the measured quantity [m/N, (m/s)/N or (m/s²)/N] of the nominal model, and at draws.

    Lines are above 0 Hz. Or of other models, the first of which takes the place of the nominal one.
    """
    derivative = quantity_of(record.measurement.quantity).derivative
    power = (2j * np.pi * frequency) ** derivative

    def response(model: "Experiment") -> Response:
        receptance = np.asarray(compiled(_receptance)(model, frequency))
        flat = receptance if receptance.ndim == 3 else receptance[:, :, record.level]
        return np.asarray(flat * power)

    nominal, *draws = map(response, record.prior_models if models is None else models)
    return nominal, draws


def _receptance(experiment: "Experiment", frequency: Float[Array, "frequency"]) -> Receptance:
    return eqx.tree_at(lambda tree: tree.frequency, experiment, frequency).receptance()
