"""Whether an effect that was found in two states is the same in both, or of another size."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import NamedTuple

import equinox as eqx
import numpy as np

from ..._shared.sites import Unknown
from ...effects.effect import Effect
from ...effects.library import kind_of
from ...inference.engines.empirical_bayes import DECREASING_ERRORS
from ...inference.residuals import Problem
from ...inference.residuals_of_state import State, name_in_state
from ..kept_fits import kept_with_sizes
from ._candidates import renamed
from ._hypotheses import Hypothesis
from ._parameter_estimate import ParameterEstimate
from ._posterior_odds import STRONG, Comparison
from ._repeated import nearest, with_swapped_names
from .fitted_model import FittedModel

NEW, CHANGED, UNCHANGED = "new", "changed", "unchanged"


class FoundEffect(NamedTuple):
    """An effect with priors, as it was found in one state.

    The setting is which part or sensor it is about, in words; the hypothesis was fitted to the
    state and its baseline. Estimates are of its unknowns, by their words within the effect.
    """

    effect: Effect
    setting: str
    estimates: Mapping[str, ParameterEstimate]
    hypothesis: Hypothesis

    @property
    def kind(self) -> str:
        """Kind of the effect."""
        return kind_of(self.effect)

    def is_comparable(self, other: "FoundEffect") -> bool:
        """Whether both are the same candidate, about the same part or sensor.

        Their names may differ where there are several of the kind.
        """
        mine = renamed(self.effect, other.effect.name)
        return self.setting == other.setting and bool(eqx.tree_equal(mine, other.effect))

    def named_as(self, other: "FoundEffect") -> "FoundEffect":
        """Return it under the name of another one, with which it swaps names."""
        name = other.effect.name
        hypothesis = with_swapped_names(self.hypothesis, self.effect.name, name)
        return self._replace(effect=renamed(self.effect, name), hypothesis=hypothesis)


def found_effects(hypothesis: Hypothesis, model: FittedModel) -> tuple[FoundEffect, ...]:
    """The effects of a hypothesis, as they were fitted."""
    experiment = hypothesis.problem.experiment
    return tuple(
        FoundEffect(
            effect,
            effect.setting(experiment.structure.modes, experiment.instruments),
            model.estimates_of(effect.name),
            hypothesis,
        )
        for effect in hypothesis.effects
    )


def change(earlier: FoundEffect, later: FoundEffect) -> str:
    """Whether an effect is unchanged in the later of two states, changed, or new elsewhere.

    Both states and the baseline are fitted at once, all else being shared: once with one effect in
    both states, once with one of another size at the same place, once with two effects. It is
    unchanged unless the evidence for something else is strong.

    Of several of a kind only those nearest to each other are compared: what is one effect in both
    states might else be any of them.
    """
    if not (_is_nearest(earlier, later) and _is_nearest(later, earlier)):
        return NEW
    earlier = earlier.named_as(later)
    unknowns = _of_effects(earlier.hypothesis)
    mine = {name for name, unknown in unknowns.items() if _is_of(unknown, earlier.effect)}
    size = {name for name in mine if _is_size(unknowns[name], earlier.effect)}
    shared = set(unknowns) - mine
    unchanged, changed = (_log_odds(earlier, later, names) for names in (shared, shared | size))
    elsewhere = -np.inf if size == mine else _log_odds(earlier, later, shared | mine)
    if unchanged > max(changed, elsewhere) - STRONG:
        return UNCHANGED
    return CHANGED if changed > elsewhere - STRONG else NEW


def _is_nearest(found: FoundEffect, other: FoundEffect) -> bool:
    """Whether an effect is the one of its hypothesis that is nearest to another one."""
    alike = nearest(found.hypothesis, other.hypothesis, other.effect)
    return alike is not None and alike.name == found.effect.name


def _of_effects(hypothesis: Hypothesis) -> dict[str, Unknown]:
    """Unknowns of the effects of a hypothesis, errors of shapes where they act included."""
    return {
        unknown.name: unknown
        for unknown in hypothesis.problem.at_fixed_sizes.unknowns
        if any(_is_of(unknown, effect) for effect in hypothesis.effects)
    }


def _is_of(unknown: Unknown, effect: Effect) -> bool:
    kinds = ("effects", "instrument_effects", "ports")
    return unknown.owner.kind in kinds and unknown.owner.name == effect.name


def _is_size(unknown: Unknown, effect: Effect) -> bool:
    """Whether an unknown of an effect may change while it stays where it is."""
    return unknown.owner.kind != "ports" and unknown.field not in effect.place_fields


def _log_odds(earlier: FoundEffect, later: FoundEffect, names: Collection[str]) -> float:
    """Log odds of both states and their baseline, some unknowns having two values."""
    first, last = earlier.hypothesis, later.hypothesis
    between = State(first.problem.experiment, first.problem.data, frozenset(names))
    problem = Problem(
        last.problem.experiment,
        last.problem.data,
        sizes=last.problem.sizes,
        baseline=last.problem.baseline,
        further=(between,),
    )
    starts = np.zeros((2, problem.dimension))
    for row, order in enumerate(((first, last), (last, first))):
        for hypothesis in order:
            _put(starts[row], problem, hypothesis, hypothesis.problem.coordinates.places)
        _put(starts[row], problem, first, names, number=2)
    sized = kept_with_sizes(problem, starts, DECREASING_ERRORS[-2:])
    return Comparison([], {}).log_odds(replace(last, effects=(), **vars(sized)))


def _put(
    point: np.ndarray,
    problem: Problem,
    hypothesis: Hypothesis,
    names: Collection[str],
    number: int = 0,
) -> None:
    """Put fitted values into a point of a problem of several states."""
    for name in names:
        target = name_in_state(name, number) if number else name
        if target in problem.coordinates.places:
            place = hypothesis.problem.coordinates.places[name]
            point[problem.coordinates.places[target]] = hypothesis.fit.point[place]
