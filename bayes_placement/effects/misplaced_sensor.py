"""misplaced_sensor: in, a sensor and what is wrong with it; out, where it sat, what it recorded.

Not known here: the structure, data.
"""

import itertools
from collections import OrderedDict
from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from numpyro.distributions import Uniform

from .._channel import Channel
from .._sites import unit
from .._types import Parameter, Receptance
from ..modes import Modes
from ._effect import InstrumentEffect, Omega, Sensors, of_sensor


class MisplacedSensor(InstrumentEffect):
    """A sensor far outside its tolerance, with its axis reversed, or with its cable swapped.

    Parameters
    ----------
    sensor
        Name of the sensor.
    shift
        How far it sits beyond its recorded place and tolerance [m].
    reversed_share
        0, or 1 where its axis points the other way; between, a mixture of both.
    swapped_with
        Name of the sensor whose channels carry its signal, and it the other's; None if none.
    swapped_share
        0, or 1 where the two are swapped.
    """

    absent: ClassVar[tuple[str, float]] = ("shift", 0.0)
    sensor: str = eqx.field(static=True)
    shift: Parameter = eqx.field(metadata=unit("m"), default=0.0)
    reversed_share: Parameter = eqx.field(metadata=unit("1"), default=0.0, kw_only=True)
    swapped_with: str | None = eqx.field(static=True, default=None, kw_only=True)
    swapped_share: Parameter = eqx.field(metadata=unit("1"), default=0.0, kw_only=True)
    name: str = eqx.field(static=True, default="misplaced_sensor", kw_only=True)

    def sensors(self, sensors: Sensors, modes: Modes) -> Sensors:
        """Sensors of which this one is shifted, as far as the structure goes."""
        moved = OrderedDict(sensors)
        position = jnp.clip(moved[self.sensor].position + self.shift, *modes.bounds())
        moved[self.sensor] = eqx.tree_at(lambda one: one.position, moved[self.sensor], position)
        return moved

    def check(self, channels: Sequence[Channel]) -> None:
        """Refuse sensors that the experiment does not have, or that cannot be swapped."""
        own = of_sensor(self.sensor, channels)
        if self.swapped_with is None:
            return
        other = of_sensor(self.swapped_with, channels)
        if np.sum(own) != np.sum(other):
            raise ValueError(
                f'Effect "{self.name}": sensors "{self.sensor}" and "{self.swapped_with}" were '
                f"given as swapped, but they have {int(np.sum(own))} and {int(np.sum(other))} "
                "channels, of which each carries one of the other. Name two sensors alike."
            )

    def recorded(self, frf: Receptance, omega: Omega, channels: Sequence[Channel]) -> Receptance:
        """FRF with the axis of the sensor reversed, or its channels swapped with another's."""
        sign = 1 - 2 * of_sensor(self.sensor, channels) * self.reversed_share
        turned = frf * sign[:, None, None]
        if self.swapped_with is None:
            return turned
        return turned + self.swapped_share * (turned[self._order(channels)] - turned)

    def _order(self, channels: Sequence[Channel]) -> np.ndarray:
        one, other = (
            [place for place, channel in enumerate(channels) if channel.name == name]
            for name in (self.sensor, self.swapped_with)
        )
        order = np.arange(len(channels))
        order[one], order[other] = other, one
        return order

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["MisplacedSensor"]:
        """Each sensor anywhere on the structure, reversed, or swapped with each other one."""
        low, high = experiment.structure.modes.bounds()
        laws = {
            name: Uniform(low - one.recorded, high - one.recorded)
            for name, one in experiment.sensor.items()
        }
        moved = [cls(name, law) for name, law in laws.items()]
        turned = [cls(name, reversed_share=1.0) for name in laws]
        swapped = [
            cls(one, swapped_with=other, swapped_share=1.0)
            for one, other in itertools.combinations(laws, 2)
        ]
        return [*moved, *turned, *swapped]


misplaced_sensor = MisplacedSensor
