"""Unknowns of a fitted hypothesis by name, with intervals."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ..._sites import Role, Unknown
from ...inference.estimates import scalars
from ._hypotheses import Hypothesis

EFFECTS = ("effects", "instrument_effects")
"""Kinds of owners that are effects."""

DRAWS = 2000
OUTER = 2.5758
"""Standard deviations between which 99 % of a normal distribution lie."""


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
    """

    mean: float
    standard_deviation: float
    low: float
    high: float
    unit: str
    effect: str | None = None
    word: str = ""
    field: str = ""

    def __str__(self) -> str:
        """Mean and standard deviation, with the unit."""
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        return f"{self.mean:.5g} ± {self.standard_deviation:.2g}{unit}"

    def to_json(self) -> dict[str, Any]:
        """Return it as numbers and words for a file; None for what cannot be said."""
        return {
            "effect": self.effect,
            "field": self.field,
            "word": self.word,
            "mean": number_or_none(self.mean),
            "standard_deviation": number_or_none(self.standard_deviation),
            "interval_99": [number_or_none(self.low), number_or_none(self.high)],
            "unit": self.unit,
        }


def estimates(
    hypothesis: Hypothesis, points: np.ndarray | None = None
) -> dict[str, ParameterEstimate]:
    """Every unknown, from draws [draw, unknown] or from Laplace's Gaussian.

    Intervals are those of a normal distribution in standard normal coordinates, as wide as the
    draws: a few hundred draws would not tell their outermost percents.
    """
    problem = hypothesis.problem
    drawn = laplace(hypothesis) if points is None else points
    spread = OUTER * drawn.std(axis=0)
    ends = drawn.mean(axis=0) + np.array([-1.0, 1.0])[:, None] * spread
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
    low, high = (float(median * np.exp(side * OUTER * deviation)) for side in (-1, 1))
    return ParameterEstimate(median, median * deviation, low, high, "1", None, "size")


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
        low, high = sorted(map(float, side.ravel()))
        mean, deviation = float(np.mean(drawn)), float(np.std(drawn))
        of = unknown.unit, effect, element, unknown.field
        yield name, ParameterEstimate(mean, deviation, low, high, *of)
