"""Two sensors whose cables are swapped."""

import itertools
from collections.abc import Sequence
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Int

from .._sites import unit
from .._types import InputError, Parameter, Receptance
from ..modes.modes import Modes
from .effect import Location, Omega
from .instrument_effect import InstrumentEffect
from .instruments import Instruments, Number
from .scales import Scales


class SwappedSensors(InstrumentEffect):
    """Two sensors of which each has its signal recorded on the channels of the other.

    Parameters
    ----------
    sensor, other
        Names of the two sensors, which have equally many channels.
    share
        1 where the two are swapped, 0 where they are not; between, a mixture.
    """

    absent: ClassVar[tuple[str, float]] = ("share", 0.0)
    sensor: Number
    other: Number
    share: Parameter = eqx.field(metadata=unit("1"), default=1.0)
    name: str = eqx.field(static=True, default="swapped_sensors", kw_only=True)

    def numbered(self, instruments: Instruments) -> "SwappedSensors":
        """Return the effect with its sensors by number.

        Raises
        ------
        InputError
            If the experiment does not have them, or one has more channels than the other.
        """
        numbers = tuple(instruments.number(sensor) for sensor in (self.sensor, self.other))
        counts = [len(instruments.rows(number)) for number in numbers]
        if counts[0] != counts[1]:
            first, second = (instruments.name(number) for number in numbers)
            raise InputError(
                f'Effect "{self.name}": sensors "{first}" and "{second}" were given, but they have '
                f"{counts[0]} and {counts[1]} channels; equally many are needed, since each "
                "channel carries the signal of one of the other. Name two sensors with as many "
                "channels."
            )
        return eqx.tree_at(lambda tree: (tree.sensor, tree.other), self, numbers)

    def recorded(self, frf: Receptance, omega: Omega, instruments: Instruments) -> Receptance:
        """FRF with the rows of the two sensors exchanged."""
        unchanged = jnp.eye(len(frf))
        rows = unchanged + self.share * (unchanged[self._rows(instruments)] - unchanged)
        # By a product, since a compiler that gathers rows may round the FRF in another way.
        return jnp.einsum("rs,saf->raf", rows.astype(frf.dtype), frf)

    def _rows(self, instruments: Instruments) -> Int[Array, "sensor"]:
        """Row whose signal each row records, where the numbers of the sensors may be traced."""
        by_sensor = [instruments.rows(number) for number in range(len(instruments.sensors))]
        most = max(map(len, by_sensor))
        table = jnp.array([[*rows, *rows[:1] * (most - len(rows))] for rows in by_sensor])
        order = jnp.arange(len(instruments.channels("sensor")))
        first, second = (instruments.number(sensor) for sensor in (self.sensor, self.other))
        return order.at[table[first]].set(table[second]).at[table[second]].set(table[first])

    def location(self, modes: Modes, instruments: Instruments) -> Location:
        """Where the first of them was recorded [m]."""
        return instruments.recorded(self.sensor)

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Names of the two sensors."""
        return f"sensors {instruments.name(self.sensor)} and {instruments.name(self.other)}"

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence["SwappedSensors"]:
        """Each two sensors swapped that have equally many channels."""
        sensors = scales.instruments.sensors
        return [
            cls(first, second)
            for first, second in itertools.combinations(sensors, 2)
            if len(sensors[first].channels) == len(sensors[second].channels)
        ]


swapped_sensors = SwappedSensors
