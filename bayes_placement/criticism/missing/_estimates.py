"""Unknowns of a fitted hypothesis by name, with intervals."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..._shared.sites import Role, Unknown
from ...inference.estimates import scalars
from ...inference.units import ReadableUnit, readable
from ._hypotheses import Hypothesis

EFFECTS = ("effects", "instrument_effects")
"""Kinds of owners that are effects."""

DRAWS = 2000
OUTER = 2.5758
"""Standard deviations between which 99 % of a normal distribution lie."""

INNER = 1.95996
"""Standard deviations between which 95 % of a normal distribution lie."""

SIDES = np.array([-OUTER, -INNER, INNER, OUTER])
"""Ends of both intervals [standard deviations]."""


class ParameterEstimate(NamedTuple):
    """What is known of one unknown.

    Parameters
    ----------
    mean, standard_deviation
        Of the posterior.
    low, high
        Its 99 % interval.
    unit
        Unit of the above.
    effect
        Name of the effect that it belongs to; None for one of the structure or its instruments.
    word
        Its name within the effect.
    field
        Field of the effect that it is, or is in; of the structure or an instrument likewise.
    low_95, high_95
        Its 95 % interval.
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
        return f"{self.in_short()} (95 %: {' to '.join(ends)})"

    def for_people(self) -> tuple[str, str, str, str]:
        """Mean, ends of the 95 % interval and unit, as people read them."""
        scale, numbers = self._scale(), (self.mean, self.low_95, self.high_95)
        mean, low, high = (scale.number(each, self.standard_deviation) for each in numbers)
        return mean, low, high, scale.name

    def _scale(self) -> ReadableUnit:
        return readable(self.unit, self.field, abs(self.mean))

    def to_json(self) -> dict[str, Any]:
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
    def from_json(cls, stated: Mapping[str, Any]) -> "ParameterEstimate":
        """Read it from a file, of earlier versions without its 95 % interval."""
        ends = [*stated["interval_99"], *stated.get("interval_95", (None, None))]
        low, high, *inner = (np.nan if end is None else float(end) for end in ends)
        mean, deviation = float(stated["mean"]), float(stated["standard_deviation"])
        names = stated["unit"], stated["effect"], stated["word"], stated["field"]
        return cls(mean, deviation, low, high, *names, *inner)


def estimates(
    hypothesis: Hypothesis, points: np.ndarray | None = None
) -> dict[str, ParameterEstimate]:
    """Every unknown, from draws [draw, unknown] or from Laplace's Gaussian.

    Intervals are those of a normal distribution in standard normal coordinates, as wide as the
    draws: a few hundred draws would not tell their outermost percents.
    """
    problem = hypothesis.problem
    drawn = laplace(hypothesis) if points is None else points
    ends = drawn.mean(axis=0) + SIDES[:, None] * drawn.std(axis=0)
    values, sides = problem.coordinates.named(drawn), problem.coordinates.named(ends)
    return {
        name: estimate
        for unknown in problem.experiment.unknowns
        if unknown.role is not Role.MODEL_ERROR
        for name, estimate in _of_unknown(unknown, values[unknown.name], sides[unknown.name])
    }


def sizes(hypothesis: Hypothesis) -> dict[str, ParameterEstimate]:
    """Unknown sizes of the model error, by what they are the size of."""
    return {
        size.owner.kind: _log_normal(value, hypothesis.deviations[size.name])
        for size in hypothesis.problem.unknown_sizes
        for value in [hypothesis.problem.sizes[size.name]]
    }


def _log_normal(median: float, deviation: float) -> ParameterEstimate:
    low, *inner, high = map(float, median * np.exp(SIDES * deviation))
    moments = median, median * deviation
    return ParameterEstimate(*moments, low, high, "1", None, "size", "size", *inner)


def errors(hypothesis: Hypothesis) -> dict[str, float]:
    """Fitted standard errors of the model error, elements of arrays one by one."""
    values = hypothesis.problem.coordinates.named(hypothesis.fit.point[None])
    return {
        name: float(np.ravel(value)[0])
        for unknown in hypothesis.problem.at_fixed_sizes.unknowns
        if unknown.role is Role.MODEL_ERROR
        for name, value in scalars(unknown.name, values[unknown.name][None])
    }


def laplace(hypothesis: Hypothesis) -> np.ndarray:
    """Draws [draw, unknown] from Laplace's Gaussian."""
    normal = np.random.default_rng(0).standard_normal((DRAWS, hypothesis.problem.dimension))
    return hypothesis.fit.gaussian.points(normal)


def number_or_none(value: float) -> float | None:
    """Return a number that JSON knows; None for any other."""
    return float(value) if np.isfinite(value) else None


def _of_unknown(
    unknown: Unknown, draws: np.ndarray, sides: np.ndarray
) -> Iterator[tuple[str, ParameterEstimate]]:
    """Name and estimate of an unknown, the elements of an array one by one."""
    effect = unknown.owner.name if unknown.owner.kind in EFFECTS else None
    word = ".".join(filter(None, (unknown.field, unknown.component)))
    names = [name for name, _ in scalars(unknown.name, draws[None])]
    ends = [side for _, side in scalars(unknown.name, sides[None])]
    for name, (element, drawn), side in zip(names, scalars(word, draws[None]), ends, strict=True):
        low, *inner, high = sorted(map(float, side.ravel()))
        moments = float(np.mean(drawn)), float(np.std(drawn))
        yield (
            name,
            ParameterEstimate(
                *moments, low, high, unknown.unit, effect, element, unknown.field, *inner
            ),
        )
