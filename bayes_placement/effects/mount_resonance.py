"""mount_resonance: in, a sensor, frequency and damping of its mount; out, the recorded FRF.

Not known here: the structure, data.
"""

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from numpyro.distributions import LogUniform

from .._sites import unit
from .._types import Parameter, Receptance
from ..positions.channel import Channel
from . import _scales, _words
from ._effect import InstrumentEffect, Numbered, Omega, numbered, of_sensor


class MountResonance(InstrumentEffect):
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
    """

    absent: ClassVar[tuple[str, float]] = ("frequency", math.inf)
    sensor: Numbered
    frequency: Parameter = eqx.field(metadata=unit("Hz"))
    damping_ratio: Parameter = eqx.field(metadata=unit("1"))
    name: str = eqx.field(static=True, default="mount_resonance", kw_only=True)

    def among(self, channels: Sequence[Channel]) -> "MountResonance":
        """Return it with the number of its sensor.

        Raises
        ------
        ValueError
            If the experiment has no such sensor.
        """
        return eqx.tree_at(lambda one: one.sensor, self, numbered(self.sensor, channels))

    def recorded(self, frf: Receptance, omega: Omega, channels: Sequence[Channel]) -> Receptance:
        """FRF whose channels of the sensor are multiplied by the transmission of the mount."""
        turn = omega / (2 * jnp.pi * self.frequency)
        loss = 2j * self.damping_ratio * turn
        excess = turn**2 / (1 - turn**2 + loss)
        return frf * (1 + of_sensor(self.sensor, channels)[:, None, None] * excess)

    def setting(self, experiment: Any) -> str:
        """Which sensor it is about."""
        return f"sensor {_words.sensor(self.sensor, experiment)}"

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["MountResonance"]:
        """A mount between the bottom of the band and ten times its top."""
        low, high = _scales.band(experiment)
        laws = LogUniform(low, 10 * high), LogUniform(0.003, 0.3)
        return [cls(sensor, *laws) for sensor in experiment.sensor]


mount_resonance = MountResonance
