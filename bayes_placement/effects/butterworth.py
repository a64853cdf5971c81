"""Butterworth filters in one channel, or in those of all sensors."""

import abc
import math
from collections.abc import Callable
from typing import TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Inexact

from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.ranges import NOT_NEGATIVE, POSITIVE
from .instruments import Instruments, Number
from .prelude import Factor, LogUniform, Omega, OnTransducer, Scales, field, unit

Kind = TypeVar("Kind", bound="Butterworth")
Lines = TypeVar("Lines", Array, np.ndarray)


class Butterworth(OnTransducer):
    """A filter of order 1 or 2 whose effect on the record was not taken out again.

    FRFs of a sensor are multiplied by its transmission, those of a force divided. McConnell and
    Varoto, Vibration Testing (2008), ch. 5.
    """

    transducer: eqx.AbstractVar[Number | None]
    frequency: eqx.AbstractVar[Parameter]
    order: eqx.AbstractVar[int]
    name: eqx.AbstractVar[str]

    def __check_init__(self) -> None:
        if self.order not in (1, 2):
            raise InputError(
                f'Effect "{self.name}": order={self.order} was given; 1 or 2 is needed, since '
                "filters of these orders are known here: order=2."
            )

    @abc.abstractmethod
    def loss(self, lines: Inexact[Array, "line"]) -> Inexact[Array, "line"]:
        """Inverse of the transmission at lines [Hz]."""

    @classmethod
    @abc.abstractmethod
    def corners(cls, band: tuple[float, float]) -> LogUniform:
        """Where the corner may be [Hz], by the least and the last line."""

    def channel_factor(self, omega: Omega, instruments: Instruments) -> Factor:
        """Return the transmission on sensors, and its inverse on actuators."""
        inverse = self.loss(omega / (2 * jnp.pi))
        factor = 1 / inverse if self.side == "sensor" else inverse
        return 1 + self.affected(instruments) * (factor - 1)

    @classmethod
    def suggest(cls: type[Kind], scales: Scales) -> list[Kind]:
        """All sensors together and each transducer."""
        sensors, actuators = scales.instruments.sensors, scales.instruments.actuators
        each = [(name, "sensor") for name in sensors if len(sensors) > 1]
        each += [(name, "actuator") for name in actuators]
        kind: Callable[..., Kind] = cls
        return [
            kind(name, cls.corners(scales.band), order, side=side)
            for name, side in [(None, "sensor"), *each]
            for order in (1, 2)
        ]


def loss_of_order(ratio: Lines, order: int) -> Lines:
    """Inverse of the transmission of a low-pass at frequencies over its corner [1]."""
    return 1 + 1j * ratio if order == 1 else 1 - ratio**2 + math.sqrt(2) * 1j * ratio


class LowPass(Butterworth):
    """A Butterworth low-pass whose effect on the record was not taken out again.

    Its transmission is 1 / (1 + i r), or 1 / (1 - r^2 + sqrt(2) i r), with r = f / frequency.
    FRFs of a sensor are multiplied by it, those of a force divided. McConnell and Varoto, Vibration
    Testing (2008), ch. 5.

    Parameters
    ----------
    transducer
        Name of the sensor or actuator; None for all sensors.
    frequency
        Corner frequency [Hz]; infinite for no filter.
    order
        1 or 2.
    side
        `sensor` or `actuator`; by default it follows from the name.
    direction
        Recorded direction of the only channel that is filtered; None for all of the transducer.

    Examples
    --------
    >>> filtered = experiment + bp.effects.low_pass("s1", frequency=2000.0, order=2)
    >>> [effect.name for effect in filtered.effects]
    ['low_pass']
    """

    absent = ("frequency", math.inf)
    transducer: Number | None
    frequency: Parameter = field(metadata=unit("Hz", within=POSITIVE))
    order: int = field(static=True, default=1)
    name: str = field(static=True, default="low_pass", kw_only=True)

    def loss(self, lines: Inexact[Array, "line"]) -> Inexact[Array, "line"]:
        """Inverse of the transmission at lines [Hz]."""
        return loss_of_order(lines / self.frequency, self.order)

    @classmethod
    def corners(cls, band: tuple[float, float]) -> LogUniform:
        """From the least line to 100 times the last."""
        return LogUniform(band[0], 100 * band[1])


class HighPass(Butterworth):
    """A Butterworth high-pass: AC coupling, or a charge amplifier that discharges too soon.

    Its transmission is 1 / (1 - i / r), or 1 / (1 - 1 / r^2 - sqrt(2) i / r), with
    r = f / frequency. FRFs of a sensor are multiplied by it, those of a force divided. McConnell
    and Varoto, Vibration Testing (2008), ch. 5.

    Parameters
    ----------
    transducer
        Name of the sensor or actuator; None for all sensors.
    frequency
        Corner frequency [Hz]; 0 for no filter.
    order
        1 or 2.
    side
        `sensor` or `actuator`; by default it follows from the name.
    direction
        Recorded direction of the only channel that is filtered; None for all of the transducer.

    Examples
    --------
    >>> filtered = experiment + bp.effects.high_pass("s1", frequency=5.0, order=2)
    >>> [effect.name for effect in filtered.effects]
    ['high_pass']
    """

    absent = ("frequency", 0.0)
    transducer: Number | None
    frequency: Parameter = field(metadata=unit("Hz", within=NOT_NEGATIVE))
    order: int = field(static=True, default=1)
    name: str = field(static=True, default="high_pass", kw_only=True)

    def loss(self, lines: Inexact[Array, "line"]) -> Inexact[Array, "line"]:
        """Inverse of the transmission at lines [Hz]: that of a low-pass at -1 / r."""
        return loss_of_order(-self.frequency / lines, self.order)

    @classmethod
    def corners(cls, band: tuple[float, float]) -> LogUniform:
        """From a hundredth of the least line to the last."""
        return LogUniform(band[0] / 100, band[1])
