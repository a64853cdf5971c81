"""Natural frequencies that drift between the runs of a roved test."""

from collections.abc import Callable

from .._shared.dimensions import Parameter, Receptance
from .instruments import Instruments, Number
from .prelude import RELATIVE, Omega, OnTransducer, Scales, field, log_uniform_of_either_sign, unit


class FrequencyDrift(OnTransducer):
    """Natural frequencies that are all 1 + drift times as high in the runs of one transducer.

    As of a stiffness that falls with the temperature, at the same masses and damping ratios:
    H(omega) becomes H(omega / (1 + drift)) / (1 + drift)^2. Xia et al., Journal of Civil Structural
    Health Monitoring 2 (2012) 29, doi:10.1007/s13349-011-0015-7.

    Parameters
    ----------
    transducer
        Name of the roved sensor, or of the actuator or hit, in whose runs they have drifted.
    drift
        Relative change of every natural frequency [1].
    side
        `sensor` or `actuator`; by default it follows from the name.
    direction
        Recorded direction of the only channel in whose run they have; None for all of them.

    Examples
    --------
    >>> warm = bp.effects.frequency_drift("a1", drift=dist.Normal(0.0, 0.01))
    >>> list((experiment + warm).unknown)
    ['structure.damping.ratio', 'sensor.s1.position', 'instrument_effects.frequency_drift.drift']
    """

    changes_modes = False
    absent = ("drift", 0.0)
    transducer: Number
    drift: Parameter = field(metadata=unit("1", within=RELATIVE))
    name: str = field(static=True, default="frequency_drift", kw_only=True)

    def evaluated(
        self, respond: Callable[[Omega], Receptance], omega: Omega, instruments: Instruments
    ) -> Receptance:
        """Receptance [m/N] of which the runs of the transducer have other natural frequencies."""
        plain, scale = respond(omega), 1 + self.drift
        drifted = respond(omega / scale) / scale**2
        return plain + self.affected(instruments) * (drifted - plain)

    @classmethod
    def suggest(cls, scales: Scales) -> list["FrequencyDrift"]:
        """Up to 3 % either way, for each roved sensor and each actuator where there are others.

        Log-uniform from 1e-5 on.
        """
        sides = ("sensor", "actuator") if scales.sensors_roved else ("actuator",)
        return [
            cls(name, log_uniform_of_either_sign(1e-5, -0.03, 0.03), side=side)
            for side in sides
            for name in scales.instruments.side(side)
            if len(scales.instruments.side(side)) > 1
        ]
