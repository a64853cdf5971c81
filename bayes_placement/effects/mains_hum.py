"""Hum of the mains in one channel, at the multiples of 50 or 60 Hz."""

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .._shared.dimensions import Parameter, Receptance
from .._shared.errors import InputError
from .._shared.ranges import ANGLE, NOT_NEGATIVE, POSITIVE
from .instruments import Instruments, Number
from .prelude import LogUniform, Omega, OnTransducer, Scales, Uniform, channels, field, unit

MAINS = (50.0, 60.0)
"""Frequencies of the mains [Hz]."""

FARTHEST = 0.1
"""Greatest width over the frequency of the mains; of lines farther apart too many are close."""

QUANTITIES = ("displacement", "velocity", "acceleration")
"""Motions, by the order of the derivative of the displacement."""


class MainsHum(OnTransducer):
    """An error of one channel at lines close to a multiple of the frequency of the mains.

    There share times the root mean square of the FRF over all lines is added, at one phase, as of
    a ground loop: Ewins, Modal Testing (2000), ch. 3. It is tried where it is named.

    Parameters
    ----------
    transducer, side
        Name of the sensor or actuator, and `sensor` or `actuator` where that leaves it open.
    share
        Amplitude over the root mean square of each FRF [1].
    phase
        Phase of what is added [rad].
    frequency
        Frequency of the mains [Hz].
    width
        Greatest distance of a line with hum from a multiple [Hz], as half the spacing of lines.
    quantity
        `displacement`, `velocity` or `acceleration`: what the sensors measure.
    direction
        Recorded direction of the only channel that hums; None for all of the transducer.

    Examples
    --------
    >>> hum = experiment + bp.effects.mains_hum("s1", 0.1, frequency=60.0, quantity="velocity")
    >>> [effect.name for effect in hum.effects]
    ['mains_hum']
    """

    changes_modes = False
    tried_by_default = False
    absent = ("share", 0.0)
    transducer: Number
    share: Parameter = field(metadata=unit("1"))
    phase: Parameter = field(metadata=unit("rad", within=ANGLE), default=0.0)
    frequency: Parameter = field(metadata=unit("Hz", within=POSITIVE), default=50.0)
    width: Parameter = field(metadata=unit("Hz", within=NOT_NEGATIVE), default=0.5)
    quantity: str = field(static=True, default="acceleration", kw_only=True)
    name: str = field(static=True, default="mains_hum", kw_only=True)

    def __check_init__(self) -> None:
        if self.quantity not in QUANTITIES:
            raise InputError(
                f'Effect "{self.name}": quantity={self.quantity!r} was given; displacement, '
                "velocity or acceleration is needed, since hum is added to what a sensor "
                "measures: quantity='acceleration'."
            )

    def recorded(self, frf: Receptance, omega: Omega, instruments: Instruments) -> Receptance:
        """FRF with hum; the sign of the frequency keeps it conjugate."""
        lines = jnp.real(omega) / (2 * jnp.pi)
        # Without 0 Hz, where no line hums.
        rate = jnp.where(lines == 0, 1.0, 1j * omega) ** QUANTITIES.index(self.quantity)
        turned = jnp.exp(1j * self.phase * jnp.sign(lines)) / rate
        polluted = close_to_multiples(lines, self.frequency, self.width)
        hum = jnp.where(polluted, self.share * turned, 0.0)
        return frf + self.affected(instruments) * hum * _level(frf * rate)

    @classmethod
    def suggest(cls, scales: Scales) -> list["MainsHum"]:
        """Each channel of a sensor with 0.01 % to tenfold its level, where lines may hum."""
        lines = np.unique(np.asarray(scales.setup.frequency, float))
        width = 0.5 * float(np.min(np.diff(lines), initial=np.inf))
        share, phase = LogUniform(1e-4, 10.0), Uniform(-math.pi, math.pi)
        return [
            cls(
                name,
                share,
                phase,
                mains,
                width,
                quantity=scales.quantity,
                side="sensor",
                direction=direction,
            )
            for name, direction in channels(scales.instruments, "sensor")
            for mains in MAINS
            if width <= FARTHEST * mains and np.any(close_to_multiples(lines, mains, width))
        ]


def close_to_multiples(
    lines: Float[Array | np.ndarray, "frequency"], mains: Parameter, width: Parameter
) -> Bool[Array | np.ndarray, "frequency"]:
    """Whether each line is close to a multiple of a frequency [Hz], above zero."""
    size = abs(lines)  # by methods alone: lines of NumPy need no compiled function
    multiple = (size / mains).round()
    return (multiple > 0) & (abs(size - multiple * mains) <= width * (1 + 1e-9))


def _level(frf: Receptance) -> Float[Array, "sensor actuator 1"]:
    """Root mean square of each FRF over the lines; its slope is finite at zero."""
    square = jnp.mean(jnp.real(frf) ** 2 + jnp.imag(frf) ** 2, axis=-1, keepdims=True)
    return jnp.sqrt(jnp.where(square > 0, square, 1.0)) * (square > 0)
