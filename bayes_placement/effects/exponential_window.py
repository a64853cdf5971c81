"""The exponential window of an impact test, which adds damping to every mode."""

from .._shared.ranges import NOT_NEGATIVE
from .prelude import InstrumentEffect, LogUniform, Omega, Parameter, Scales, field, unit


class ExponentialWindow(InstrumentEffect):
    """A window exp(-t / tau) on force and response, whose effect was not taken out again.

    The windowed signals have their transforms at s = i omega + 1 / tau, and so has the FRF: each
    damping ratio grows by 1 / (tau omega_n). Fladung and Rost, Mechanical Systems and Signal
    Processing 11 (1997) 23.

    Parameters
    ----------
    rate
        Inverse of the time constant tau [1/s].

    Examples
    --------
    >>> window = bp.effects.exponential_window(rate=1 / 0.3)  # a time constant of 0.3 s
    >>> [effect.name for effect in (experiment + window).effects]
    ['exponential_window']
    """

    changes_modes = False
    absent = ("rate", 0.0)
    acts_on = "all_channels"
    rate: Parameter = field(metadata=unit("1/s", within=NOT_NEGATIVE))
    name: str = field(static=True, default="exponential_window", kw_only=True)

    def laplace(self, omega: Omega) -> Omega:
        """Return s / i = omega - i / tau."""
        return omega - 1j * self.rate

    @classmethod
    def suggest(cls, scales: Scales) -> list["ExponentialWindow"]:
        """A window that adds 0.003 % to 10 % to a damping ratio in the middle of the band."""
        middle = scales.angular_frequency
        return [cls(LogUniform(3e-5 * middle, 0.1 * middle))]
