"""Butterworth filters in one channel, or in those of all sensors."""

import abc
import math
from collections.abc import Callable
from typing import Any, TypeVar

import equinox as eqx
import jax.numpy as jnp

from .._shared.errors import InputError
from .instruments import Instruments, Number
from .prelude import Factor, LogUniform, Omega, OnTransducer, Scales

Kind = TypeVar("Kind", bound="Butterworth")


class Butterworth(OnTransducer):
    """A filter of order 1 or 2 whose effect on the record was not taken out again.

    FRFs of a sensor are multiplied by its transmission, those of a force divided. McConnell and
    Varoto, Vibration Testing (2008), ch. 5.
    """

    transducer: eqx.AbstractVar[Number | None]
    frequency: eqx.AbstractVar[Any]
    order: eqx.AbstractVar[int]
    name: eqx.AbstractVar[str]

    def __check_init__(self) -> None:
        if self.order not in (1, 2):
            raise InputError(
                f'Effect "{self.name}": order={self.order} was given; 1 or 2 is needed, since '
                "filters of these orders are known here: order=2."
            )

    @abc.abstractmethod
    def loss(self, lines: Any) -> Any:
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


def loss_of_order(ratio: Any, order: int) -> Any:
    """Inverse of the transmission of a low-pass at frequencies over its corner [1]."""
    return 1 + 1j * ratio if order == 1 else 1 - ratio**2 + math.sqrt(2) * 1j * ratio
