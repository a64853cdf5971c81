"""A wrong sampling rate, which scales the axis of frequency."""

from .._shared.dimensions import Parameter
from .prelude import RATE, InstrumentEffect, Omega, Scales, field, log_uniform_of_either_sign, unit


class FrequencyScale(InstrumentEffect):
    """Lines that were truly at 1 + rate_error times the frequency at which they are recorded.

    As of signals sampled at fs (1 + rate_error) where fs is believed. Force and motion have the
    right amplitude, so that an accelerance is that of the true frequency, by its square; delays and
    filters act at the true frequency too. Signals at a wrong rate are those of another scale of
    time: Oppenheim and Schafer, Discrete-Time Signal Processing (2010), ch. 4.

    Parameters
    ----------
    rate_error
        True over believed sampling rate, less one [1].

    Examples
    --------
    >>> wrong = experiment + bp.effects.frequency_scale(dist.Normal(0.0, 0.01))
    >>> list(wrong.unknown)[2:]
    ['instrument_effects.frequency_scale.rate_error']
    """

    changes_modes = False
    absent = ("rate_error", 0.0)
    acts_on = "all_channels"
    rate_error: Parameter = field(metadata=unit("1", within=RATE))
    name: str = field(static=True, default="frequency_scale", kw_only=True)

    def laplace(self, omega: Omega) -> Omega:
        """Return the true angular frequency [rad/s]."""
        return omega * (1 + self.rate_error)

    @classmethod
    def suggest(cls, scales: Scales) -> list["FrequencyScale"]:
        """Up to 10 % either way, log-uniform from 1e-5 on."""
        return [cls(log_uniform_of_either_sign(1e-5, -0.1, 0.1))]
