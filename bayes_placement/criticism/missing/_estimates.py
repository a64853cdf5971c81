"""Unknowns of a fitted hypothesis by name, with intervals."""

from collections.abc import Iterator, Sequence

import numpy as np

from ..._shared.sites import Role, Unknown
from ...effects.compliant_support import CompliantSupport
from ...effects.effect import AtPlace, Effect
from ...experiment.experiment import Experiment
from ...inference.estimates import scalars
from ..locations import Values, ends, lengths_as_read, locations
from ._hypotheses import Hypothesis
from ._parameter_estimate import AT, ParameterEstimate

EFFECTS = ("effects", "instrument_effects")
"""Kinds of owners that are effects."""

DRAWS = 2000
OUTER = 2.5758
"""Standard deviations between which 99 % of a normal distribution lie."""

INNER = 1.95996
"""Standard deviations between which 95 % of a normal distribution lie."""

SIDES = np.array([-OUTER, -INNER, INNER, OUTER])
"""Ends of both intervals [standard deviations]."""

PERCENTILES = (2.5, 97.5)
"""Ends of a 95 % interval [%]."""


def estimates(
    hypothesis: Hypothesis, points: np.ndarray | None = None
) -> dict[str, ParameterEstimate]:
    """Every unknown, from draws [draw, unknown] or from Laplace's Gaussian.

    Intervals are those of a normal distribution in standard normal coordinates, as wide as the
    draws: a few hundred draws would not tell their outermost percents.
    """
    problem = hypothesis.problem
    drawn = laplace(hypothesis) if points is None else points
    outer = drawn.mean(axis=0) + SIDES[:, None] * drawn.std(axis=0)
    values, sides, best = (
        problem.coordinates.named(each) for each in (drawn, outer, hypothesis.fit.point[None])
    )
    nodes = [_at_nodes(hypothesis, each) for each in (values, sides, best)]
    values, sides = values | nodes[0], sides | nodes[1]
    told = {
        name: estimate
        for unknown in problem.experiment.unknowns
        if unknown.role is not Role.MODEL_ERROR
        for name, estimate in _of_unknown(
            unknown, values[unknown.name], sides[unknown.name], problem.experiment
        )
    }
    # A mean of nodes is none: the node is that of the best fit.
    return told | {name: told[name]._replace(mean=float(at[0])) for name, at in nodes[2].items()}


def _at_nodes(hypothesis: Hypothesis, values: Values) -> dict[str, np.ndarray]:
    """Places of all effects as the nodes that are read, by the names of their coordinates."""
    experiment, count = hypothesis.problem.experiment, len(next(iter(values.values()), ()))
    read = [lengths_as_read(effect, experiment, values, count) for effect in experiment.effects]
    return {name: lengths for each in read for name, lengths in each.items()}


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


def _of_unknown(
    unknown: Unknown, draws: np.ndarray, sides: np.ndarray, experiment: Experiment
) -> Iterator[tuple[str, ParameterEstimate]]:
    """Name and estimate of an unknown, the elements of an array one by one."""
    effect = unknown.owner.name if unknown.owner.kind in EFFECTS else None
    word = ".".join(filter(None, (unknown.field, unknown.component)))
    names = [name for name, _ in scalars(unknown.name, draws[None])]
    ends = [side for _, side in scalars(unknown.name, sides[None])]
    words, columns = zip(*scalars(word, draws[None]), strict=True)
    if effect is not None:
        words = _of_pairs(word, words, experiment)
    for name, element, drawn, side in zip(names, words, columns, ends, strict=True):
        low, *inner, high = sorted(map(float, side.ravel()))
        moments = float(np.mean(drawn)), float(np.std(drawn))
        yield (
            name,
            ParameterEstimate(
                *moments, low, high, unknown.unit, effect, element, unknown.field, *inner
            ),
        )


def _of_pairs(word: str, words: Sequence[str], experiment: Experiment) -> Sequence[str]:
    """Words of the elements of an array by the pairs of channels that they are of."""
    sensors, actuators = experiment.sensor_channels, experiment.actuator_channels
    if len(words) == 1 or len(words) != len(sensors) * len(actuators):
        return words
    several = len(actuators) > 1
    return [
        f"{word}{AT}{sensor.label}{f' from {actuator.label}' if several else ''}"
        for sensor in sensors
        for actuator in actuators
    ]


def drawn_places(effect: Effect, hypothesis: Hypothesis) -> list[np.ndarray]:
    """Draws of each place of an effect [draw, coordinate]; of a part its two ends or corners."""
    values = hypothesis.problem.coordinates.named(laplace(hypothesis))
    return places_at(effect, hypothesis.problem.experiment, values)


def places_at(effect: Effect, experiment: Experiment, values: Values) -> list[np.ndarray]:
    """Each place of an effect [point, coordinate] at points; of a part its two ends or corners."""
    if not isinstance(effect, AtPlace | CompliantSupport):
        return []
    known = effect, experiment, values, len(next(iter(values.values())))
    places = [locations(*known)] if isinstance(effect, CompliantSupport) else ends(*known)
    return [place[:, np.isfinite(place).all(axis=0)] for place in places]
