"""A sensor on a soft mount."""

import math

import jax.numpy as jnp

from .._shared.dimensions import Parameter
from .._shared.ranges import POSITIVE, SHARE_OF_CRITICAL
from .butterworth import Lines
from .prelude import Factor, Instruments, LogUniform, Number, OfSide, Omega, Scales, field, unit


class MountResonance(OfSide):
    """A sensor on a soft mount, a factor (w0^2 + 2 i z w0 w) / (w0^2 - w^2 + 2 i z w0 w).

    ISO 5348: the sensor moves as an oscillator driven through its foot; w0 is infinite for a rigid
    mount.

    Parameters
    ----------
    sensor
        Name of the sensor.
    frequency
        Natural frequency w0 / (2 pi) of the sensor on its mount [Hz].
    damping_ratio
        Damping ratio z of the mount [1].

    Examples
    --------
    >>> soft = bp.effects.mount_resonance("s1", frequency=2000.0, damping_ratio=0.05)
    >>> [effect.name for effect in (experiment + soft).effects]
    ['mount_resonance']
    """

    absent = ("frequency", math.inf)
    side = "sensor"
    sensor: Number
    frequency: Parameter = field(metadata=unit("Hz", within=POSITIVE))
    damping_ratio: Parameter = field(metadata=unit("1", within=SHARE_OF_CRITICAL))
    name: str = field(static=True, default="mount_resonance", kw_only=True)

    def channel_factor(self, omega: Omega, instruments: Instruments) -> Factor:
        """Return the transmission of the mount on the channels of the sensor."""
        ratio = omega / (2 * jnp.pi * self.frequency)
        return 1 + instruments.of(self.sensor)[:, None, None] * excess(ratio, self.damping_ratio)

    @classmethod
    def suggest(cls, scales: Scales) -> list["MountResonance"]:
        """A resonance between the least line and ten times the greatest, for each sensor."""
        low, high = scales.band
        frequency, damping_ratio = LogUniform(low, 10 * high), LogUniform(0.003, 0.3)
        return [cls(sensor, frequency, damping_ratio) for sensor in scales.instruments.sensors]


def excess(ratio: Lines, damping_ratio: Parameter) -> Lines:
    """Transmission less 1 of a mount at frequencies over its resonance [1]."""
    return ratio**2 / (1 - ratio**2 + 2j * damping_ratio * ratio)
