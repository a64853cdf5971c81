"""Effects of a kind that a hypothesis has more than once: which may be, and under which names."""

import functools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import equinox as eqx
import jax
import numpy as np

from ..._shared.sites import Unknown, is_unknown
from ...effects.amplitude_attachment import can_act_together
from ...effects.effect import Effect
from ...effects.library import kind_of
from ...experiment.experiment import Experiment
from ...inference.residuals import Problem, fields_of
from ._candidates import renamed
from ._hypotheses import Hypothesis


def may_be_added(effect: Effect, problem: Problem, branch: Hypothesis) -> bool:
    """Whether an effect is one more beside those of a hypothesis.

    It can act together with them. It is of another kind; or it may be there more than once, and
    this one is elsewhere or about something else: two delays of one channel are one.
    """
    kind = kind_of(effect)
    if not can_act_together((*branch.effects, effect)):
        return False
    if kind not in branch.kinds:
        return True
    if not effect.may_repeat:
        return False
    if effect.may_coincide or _may_be_anywhere(effect, problem.experiment):
        return True
    others = [other for other in branch.effects if kind_of(other) == kind]
    settings = {_setting(other, branch.problem.experiment) for other in others}
    return _setting(effect, problem.experiment) not in settings


def _may_be_anywhere(effect: Effect, experiment: Experiment) -> bool:
    """Whether the place of an effect is unknown, so that two of them are at two places."""
    modes, instruments = experiment.structure.modes, experiment.instruments
    place = _placed(effect, experiment).location(modes, instruments)
    return any(map(is_unknown, jax.tree.leaves(place, is_leaf=is_unknown)))


def _setting(effect: Effect, experiment: Experiment) -> str:
    placed = _placed(effect, experiment)
    return placed.setting(experiment.structure.modes, experiment.instruments)


def _placed(effect: Effect, experiment: Experiment) -> Effect:
    """An effect as it is in an experiment, its transducers by number."""
    return next(present for present in experiment.effects if present.name == effect.name)


def with_swapped_names(hypothesis: Hypothesis, name: str, other: str) -> Hypothesis:
    """Return a hypothesis with two names of effects swapped; which order they have means nothing.

    It may lack one of the two.
    """
    if name == other:
        return hypothesis
    names = {name: other, other: name}
    effects = tuple(renamed(each, names.get(each.name, each.name)) for each in hypothesis.effects)
    problem = _with_effects(hypothesis.problem, hypothesis.effects, effects)
    point = _point_with_names(hypothesis, problem, names)
    fit = hypothesis.fit._replace(point=point)
    return replace(hypothesis, effects=effects, problem=problem, fit=fit)


def _with_effects(problem: Problem, before: Sequence[Effect], after: Sequence[Effect]) -> Problem:
    """A problem with other effects in the place of those of a hypothesis."""
    bare = functools.reduce(Experiment.without, (each.name for each in before), problem.experiment)
    experiment = functools.reduce(Experiment.__add__, after, bare)
    _, data, sizes, baseline, further = problem.content
    return Problem(experiment, data, sizes=sizes, baseline=baseline, further=further)


def _point_with_names(
    hypothesis: Hypothesis, problem: Problem, names: Mapping[str, str]
) -> np.ndarray:
    """The fit as coordinates of a problem whose effects have other names."""
    before = hypothesis.problem
    here = {_key(unknown, {}): name for name, unknown in problem.experiment.unknown.items()}
    point = np.zeros(problem.dimension)
    for name, place in before.coordinates.places.items():
        target = here[_key(before.experiment.unknown[name], names)]
        point[problem.coordinates.places[target]] = hypothesis.fit.point[place]
    return point


def _key(unknown: Unknown, names: Mapping[str, str]) -> tuple[object, ...]:
    """What an unknown is of, its owner under a new name."""
    owner = unknown.owner
    return owner.kind, names.get(owner.name, owner.name), unknown.field, unknown.path


def named_alike(hypothesis: Hypothesis, known: Hypothesis) -> Hypothesis:
    """Return a hypothesis of which each effect that another one has too is named as there.

    Of several of a kind, the same candidate, and of the same candidates the nearest.
    """
    done: set[str] = set()
    for effect in known.effects:
        found = nearest(hypothesis, known, effect, done)
        if found is not None:
            hypothesis = with_swapped_names(hypothesis, found.name, effect.name)
            done.add(effect.name)
    return hypothesis


def nearest(
    hypothesis: Hypothesis, other: Hypothesis, effect: Effect, taken: Collection[str] = ()
) -> Effect | None:
    """Return the effect of a hypothesis most like one of another, if of its kind and not taken."""
    alike = [each for each in hypothesis.effects if kind_of(each) == kind_of(effect)]
    free = [each for each in alike if each.name not in taken]
    return min(free, key=lambda each: _distance(hypothesis, each, other, effect), default=None)


def _distance(first: Hypothesis, effect: Effect, second: Hypothesis, other: Effect) -> float:
    """Distance of the places of two effects, in standard deviations of their prior."""
    if not eqx.tree_equal(renamed(effect, other.name), other):
        return float("inf")
    return float(np.linalg.norm(_place(first, effect) - _place(second, other)))


def _place(hypothesis: Hypothesis, effect: Effect) -> np.ndarray:
    """Coordinates of the place of an effect."""
    problem = hypothesis.problem
    parts = [
        hypothesis.fit.point[problem.coordinates.places[name]]
        for name, field in fields_of(effect, problem).items()
        if field in effect.place_fields
    ]
    return np.concatenate([np.zeros(0), *parts])
