"""A phase error of one channel that varies slowly over the band."""

import jax.numpy as jnp

from .._shared.ranges import ANGLE, POSITIVE, log_uniform_of_either_sign
from .on_transducer import OnTransducer, on_each_channel
from .prelude import Factor, Instruments, Number, Omega, Parameter, Scales, Uniform, field, unit


class PhaseDrift(OnTransducer):
    """A phase lag phase (f / reference)^exponent of one channel, at an amplitude that is right.

    The exponent is -1 for the lead of an AC coupling or of a charge amplifier well above its
    corner, a negative phase of the size corner / reference; 0 for one lag at all lines; 1 for a
    delay. McConnell and Varoto, Vibration Testing (2008), ch. 4. A line at 0 Hz stays as it is.
    It is tried where it is named.

    Parameters
    ----------
    transducer, side
        Name of the sensor or actuator, and `sensor` or `actuator` where that leaves it open.
    phase
        Lag of its FRFs at the reference frequency [rad].
    reference
        Reference frequency [Hz].
    exponent
        Growth of the lag with frequency [1].
    direction
        Recorded direction of the only channel that lags; None for all of the transducer.

    Examples
    --------
    >>> lead = bp.effects.phase_drift("s1", dist.Normal(0.0, 0.1), reference=100.0, exponent=-1.0)
    >>> list((experiment + lead).unknown)
    ['structure.damping.ratio', 'sensor.s1.position', 'instrument_effects.phase_drift.phase']
    """

    changes_modes = False
    tried_by_default = False
    absent = ("phase", 0.0)
    transducer: Number
    phase: Parameter = field(metadata=unit("rad", within=ANGLE))
    reference: Parameter = field(metadata=unit("Hz", within=POSITIVE))
    exponent: Parameter = field(metadata=unit("1"), default=0.0)
    name: str = field(static=True, default="phase_drift", kw_only=True)

    def channel_factor(self, omega: Omega, instruments: Instruments) -> Factor:
        """Return exp(-i lag) on the channels that lag; the sign of f keeps it conjugate."""
        frequency = jnp.real(omega) / (2 * jnp.pi)
        size = jnp.where(frequency == 0, 1.0, jnp.abs(frequency)) / self.reference
        lag = jnp.sign(frequency) * self.phase * size**self.exponent
        return jnp.exp(-1j * self.affected(instruments) * lag)

    @classmethod
    def suggest(cls, scales: Scales) -> list["PhaseDrift"]:
        """Each channel with up to 0.5 rad in the middle of the band, either way.

        Log-uniform from 1e-4 rad on.
        """
        phase, exponent = log_uniform_of_either_sign(1e-4, -0.5, 0.5), Uniform(-1.0, 1.0)
        return on_each_channel(cls, scales, phase, scales.middle, exponent)
