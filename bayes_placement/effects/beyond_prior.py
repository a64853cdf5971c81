"""A number of the structure that lies beyond the end of its prior."""

from collections.abc import Callable, Iterator

import numpy as np
from numpyro.distributions import Distribution, LogUniform, Uniform

from .._shared.ranges import Range, ends
from .._shared.sites import STANDS_FOR
from .prelude import Instruments, Modes, Parameter, Scales, StructureEffect, field, unit

FACTOR, WIDTHS = 3.0, 2.0
"""How far a default prior goes beyond the end of another one: up to a factor where that has no
negative values, else so many of its widths."""

Beyond = tuple[float, Distribution]
"""End of a prior, and a prior of what lies beyond it."""


class BeyondPrior(StructureEffect):
    """A number of the structure has a value that its prior excludes.

    Nothing is missing then: a Young's modulus, a density, a dimension, a damping ratio or a
    stiffness was taken for known better than it is. The value takes the place of the unknown, whose
    prior counts no more.

    Parameters
    ----------
    unknown
        Name of what lies beyond its prior: `structure.modes.youngs_modulus`.
    value
        Its value, in its own unit.
    end
        Where its prior ends, in its own unit.

    Examples
    --------
    >>> damped = structure + bp.effects.beyond_prior("structure.damping.ratio", 0.09, end=0.06)
    >>> damped.damping
    Modal(ratio=0.09)
    """

    may_be_new = False
    unknown: str = field(static=True)
    value: Parameter = field(metadata=unit("") | {STANDS_FOR: "unknown"})
    end: float
    name: str = field(static=True, default="beyond_prior", kw_only=True)

    @property
    def absent(self) -> tuple[str, float]:  # type: ignore[override]
        """The value, and the end of the prior."""
        return "value", self.end

    @property
    def variant(self) -> str:
        """Its kind and the name of what lies beyond its prior."""
        return f"{self.kind} of {self.unknown}"

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Name of what lies beyond its prior."""
        return self.unknown

    @classmethod
    def suggest(cls, scales: Scales) -> list["BeyondPrior"]:
        """Each number of the structure beyond each end of its prior.

        Places of transducers, their gains and delays are left out, for which there are other
        effects.
        """
        return [
            cls(unknown.name, value, end)
            for unknown in scales.unknown_numbers()
            for end, value in _beyond(unknown.distribution, unknown.within)
        ]


def _beyond(prior: Distribution, within: Range | None) -> Iterator[Beyond]:
    """Each end of a prior, with a prior of what lies beyond but within a range."""
    low, high = ends(prior)
    least, most = (-np.inf, np.inf) if within is None else within[:2]
    scale: Callable[[float, float], Distribution] = LogUniform if low >= 0 else Uniform
    step = WIDTHS * (high - low)
    least = max(least, low / FACTOR if low >= 0 else low - step)
    most = min(most, high * FACTOR if low >= 0 else high + step)
    if -np.inf < least < low:
        yield low, scale(least, low)
    if high < most < np.inf:
        yield high, scale(high, most)
