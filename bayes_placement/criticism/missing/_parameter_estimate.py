"""What is known of an unknown, in words and as JSON."""

from typing import NamedTuple

import numpy as np

from ..._shared.files import Json
from ...inference.units import ReadableUnit, readable

AT = " at "
"""Stands in a word before the channels that a number is of."""

PLACES = ("at", "to")
"""Fields that are told as places."""

AXES = {"1": "x", "2": "y", "3": "z"}
"""Axes in space by the number of a component."""


class ParameterEstimate(NamedTuple):
    """What is known of one unknown, of the posterior and in its unit.

    `low` and `high` end its 99 % interval, `low_95` and `high_95` its 95 % interval. An unknown of
    the structure or its instruments has no effect. `word` is its name within the effect, `field`
    the field of the effect, the structure or the instrument that it is, or is in.
    """

    mean: float
    standard_deviation: float
    low: float
    high: float
    unit: str
    effect: str | None = None
    word: str = ""
    field: str = ""
    low_95: float = float("nan")
    high_95: float = float("nan")

    @property
    def is_of_channels(self) -> bool:
        """Whether it is one of many, one for each pair of channels."""
        return AT in self.word

    def __str__(self) -> str:
        """Mean and standard deviation, in the unit of people."""
        scale = self._scale()
        mean = scale.number(self.mean, self.standard_deviation)
        deviation = scale.spread(self.standard_deviation, self.mean)
        return f"{mean} ± {deviation} {scale.name}".rstrip()

    def in_short(self) -> str:
        """Mean in the unit of people, with as many digits as are known."""
        scale = self._scale()
        return f"{scale.number(self.mean, self.standard_deviation)} {scale.name}".rstrip()

    def with_interval(self) -> str:
        """Mean and 95 % interval, in the unit of people."""
        if not np.isfinite([self.low_95, self.high_95]).all():
            return str(self)
        _, *ends, _ = self.for_people()
        if self.low_95 == self.high_95:
            return self.in_short()
        return f"{self.in_short()} (95 %: {' to '.join(ends)})"

    def for_people(self) -> tuple[str, str, str, str]:
        """Mean, ends of the 95 % interval and unit, as people read them."""
        scale, numbers = self._scale(), (self.mean, self.low_95, self.high_95)
        mean, low, high = (scale.number(each, self.standard_deviation) for each in numbers)
        return mean, low, high, scale.name

    def _scale(self) -> ReadableUnit:
        return readable(self.unit, self.field, abs(self.mean))

    def to_json(self) -> Json:
        """Return it as numbers and words for a file; None for numbers that are not finite."""
        return {
            "effect": self.effect,
            "field": self.field,
            "word": self.word,
            "mean": number_or_none(self.mean),
            "standard_deviation": number_or_none(self.standard_deviation),
            "interval_99": [number_or_none(self.low), number_or_none(self.high)],
            "interval_95": [number_or_none(self.low_95), number_or_none(self.high_95)],
            "unit": self.unit,
        }

    @classmethod
    def from_json(cls, stated: Json) -> "ParameterEstimate":
        """Read it from a file."""
        ends = [*stated["interval_99"], *stated["interval_95"]]
        low, high, *inner = (np.nan if end is None else float(end) for end in ends)
        mean, deviation = float(stated["mean"]), float(stated["standard_deviation"])
        names = stated["unit"], stated["effect"], stated["word"], stated["field"]
        return cls(mean, deviation, low, high, *names, *inner)


def spoken(word: str) -> str:
    """Write a path as people say it: extent along x for extent.1, at x for at.x, at for at.along.

    The distance along a member needs no name: the setting says which member it is.
    """
    if word.partition(".")[0] in PLACES:
        return word.removesuffix(".along").replace(".", " ")
    field, _, number = word.rpartition(".")
    return f"{field} along {AXES[number]}" if field and number in AXES else word


def number_or_none(value: float) -> float | None:
    """Return a number that JSON knows; None for any other."""
    return float(value) if np.isfinite(value) else None
