"""A wrong sampling rate, which scales the axis of frequency."""

from collections.abc import Sequence
from typing import ClassVar

import equinox as eqx

from .._ranges import RATE
from .._sites import unit
from .._types import Parameter
from .effect import Omega
from .instrument_effect import InstrumentEffect
from .scales import Scales
from .signed import log_uniform_of_either_sign


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

    changes_modes: ClassVar[bool] = False
    absent: ClassVar[tuple[str, float]] = ("rate_error", 0.0)
    rate_error: Parameter = eqx.field(metadata=unit("1", within=RATE))
    name: str = eqx.field(static=True, default="frequency_scale", kw_only=True)

    @property
    def acts_on(self) -> str:
        """What it acts on, as a result says it."""
        return "all_channels"

    def laplace(self, omega: Omega) -> Omega:
        """Return the true angular frequency [rad/s]."""
        return omega * (1 + self.rate_error)

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence["FrequencyScale"]:
        """Up to 10 % either way, log-uniform from 1e-5 on."""
        return [cls(log_uniform_of_either_sign(1e-5, -0.1, 0.1))]


frequency_scale = FrequencyScale
