"""Two sensors, or two actuators, whose records are swapped."""

import itertools
from collections.abc import Sequence
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Int

from .._shared.dimensions import Parameter, Receptance
from .._shared.errors import InputError
from .instrument_effect import Alone
from .prelude import Instruments, Modes, Number, OfSide, Omega, Scales, field, unit


class Swapped(OfSide):
    """Two transducers of a side of which each has its record on the channels of the other."""

    absent: ClassVar[tuple[str, float]] = ("share", 0.0)
    other: eqx.AbstractVar[Number]

    @property
    def pair(self) -> tuple[Number, Number]:
        """Names or numbers of the two."""
        return self.transducer, self.other

    def numbered(self, instruments: Instruments) -> "Swapped":
        """Return the effect with its transducers by number."""
        side = self.side
        numbers = tuple(instruments.number(transducer, side) for transducer in self.pair)
        if self.pair[0] == self.pair[1] and isinstance(self.other, str):
            raise InputError(
                f'Effect "{self.name}": {side} "{self.other}" was given twice; two {side}s are '
                "needed, since the records of both are exchanged. Name another as the second."
            )
        counts = [len(instruments.rows(number, side)) for number in numbers]
        if counts[0] != counts[1]:
            first, second = (instruments.name(number, side) for number in numbers)
            raise InputError(
                f'Effect "{self.name}": {side}s "{first}" and "{second}" were given, but they have '
                f"{counts[0]} and {counts[1]} channels; equally many are needed, since each "
                f"channel carries the signal of one of the other. Name two {side}s with as many "
                "channels."
            )
        return eqx.tree_at(lambda tree: (getattr(tree, side), tree.other), self, numbers)

    def alone(self, instruments: Instruments) -> Alone:
        """Return it on the two of an experiment that has these alone."""
        side = self.side
        numbers = sorted(int(instruments.number(transducer, side)) for transducer in self.pair)
        first, second = (instruments.name(number, side) for number in numbers)
        alone = eqx.tree_at(lambda tree: (getattr(tree, side), tree.other), self, (0, 1))
        return Alone(alone, side, (first, second))

    def recorded(self, frf: Receptance, omega: Omega, instruments: Instruments) -> Receptance:
        """FRF with the channels of the two exchanged."""
        unchanged = jnp.eye(len(instruments.channels(self.side)))
        share: Parameter = getattr(self, self.absent[0])
        rows = unchanged + share * (unchanged[self._rows(instruments)] - unchanged)
        # By a product, since a compiler that gathers rows may round the FRF in another way.
        indices = "rs,saf->raf" if self.side == "sensor" else "ba,saf->sbf"
        return jnp.einsum(indices, rows.astype(frf.dtype), frf)

    def _rows(self, instruments: Instruments) -> Int[Array, "channel"]:
        """Row whose signal each row records, where the numbers may be traced."""
        side = self.side
        count = len(instruments.side(side))
        by_transducer = [instruments.rows(number, side) for number in range(count)]
        most = max(map(len, by_transducer))
        table = jnp.array([[*rows, *rows[:1] * (most - len(rows))] for rows in by_transducer])
        order = jnp.arange(len(instruments.channels(side)))
        first, second = (instruments.number(transducer, side) for transducer in self.pair)
        return order.at[table[first]].set(table[second]).at[table[second]].set(table[first])

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Names of the two."""
        first, second = (instruments.name(number, self.side) for number in self.pair)
        return f"{self.side}s {first} and {second}"

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence["Swapped"]:
        """Each two transducers swapped that have as many channels."""
        transducers = scales.instruments.side(cls.side)
        return [
            cls(first, second)  # type: ignore[call-arg]
            for first, second in itertools.combinations(transducers, 2)
            if len(transducers[first].channels) == len(transducers[second].channels)
        ]


class SwappedSensors(Swapped):
    """Two sensors of which each has its signal recorded on the channels of the other.

    Parameters
    ----------
    sensor, other
        Names of the two sensors, which have equally many channels.
    share
        1 where the two are swapped, 0 where they are not; between, a mixture.

    Examples
    --------
    >>> sensors = [bp.Sensor("s1", at=0.2), bp.Sensor("s2", at=0.4)]
    >>> two = bp.Experiment(structure, **setup | {"sensors": sensors})
    >>> [effect.name for effect in (two + bp.effects.swapped_sensors("s1", "s2")).effects]
    ['swapped_sensors']
    """

    side = "sensor"
    sensor: Number
    other: Number
    share: Parameter = field(metadata=unit("1"), default=1.0)
    name: str = field(static=True, default="swapped_sensors", kw_only=True)


class SwappedActuators(Swapped):
    """Two actuators or hits of which each has its runs recorded under the name of the other.

    Parameters
    ----------
    actuator, other
        Names of the two actuators, which have equally many channels.
    share
        1 where the two are swapped, 0 where they are not; between, a mixture.

    Examples
    --------
    >>> actuators = [bp.Actuator("a1", at=0.3), bp.Actuator("a2", at=0.6)]
    >>> two = bp.Experiment(structure, **setup | {"actuators": actuators})
    >>> [effect.name for effect in (two + bp.effects.swapped_actuators("a1", "a2")).effects]
    ['swapped_actuators']
    """

    changes_modes = False
    side = "actuator"
    actuator: Number
    other: Number
    share: Parameter = field(metadata=unit("1"), default=1.0)
    name: str = field(static=True, default="swapped_actuators", kw_only=True)
