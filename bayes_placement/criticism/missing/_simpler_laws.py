"""Simpler effects of the library where the best one acts, each fitted from its fit.

With a model error each effect descends from its own places, where all else is far off; one of more
numbers may find the way, and a simpler one that would explain as much be left elsewhere.
"""

from dataclasses import replace

import numpy as np

from ..._shared.sites import is_unknown
from ...effects.attached import Attached
from ...effects.eccentric_mass import EccentricMass
from ...effects.effect import Effect
from ...effects.library import kind_of
from ...inference.engines.empirical_bayes import DECREASING_ERRORS
from ...laws.catalogue import leaves
from ..kept_fits import kept_with_sizes
from ..reach._ports import field_columns
from ._hypotheses import Hypothesis, finite
from ._networks import LISTED, Network
from ._posterior_odds import Comparison

STRENGTHS, FOLLOWED = 21, 3
"""Strengths between the ends of the prior that are looked at, and of these that are followed."""

WITHIN = 3.0
"""Standard normal coordinate of the greatest of them."""


def with_simpler_laws(comparison: Comparison) -> Comparison:
    """Fit the networks of fewer elements where the best effect acts, if it has a model error."""
    best, null = comparison.best(), comparison.of(())
    fits = [_in_its_place(best, each, null) for each in _simpler(best, comparison)]
    return comparison.with_hypotheses(finite(fits))


def _simpler(best: Hypothesis, comparison: Comparison) -> list[Effect]:
    """Candidates of one number on the same piece of the structure, in the same direction."""
    if not best.has_errors or len(best.effects) != 1:
        return []
    (effect,) = best.effects
    letters = _elements(effect)
    experiment = best.problem.experiment
    on = experiment.structure.modes, experiment.instruments
    return [
        each.effect
        for each in comparison.candidates
        if LISTED.get(kind_of(each.effect)) in letters
        and each.effect.setting(*on) == effect.setting(*on)
        and is_unknown(getattr(each.effect, each.effect.absent[0]))
    ]


def _elements(effect: Effect) -> list[Network]:
    """Elements of a network of several, each by itself; of a body its mass."""
    if isinstance(effect, EccentricMass):
        return [("displacement", "m")]
    acts_on, network = LISTED.get(kind_of(effect), (effect.acts_on, ""))
    elements = leaves(effect.law.tree() if isinstance(effect, Attached) else network)
    return [(acts_on, letter) for letter in elements] if len(elements) > 1 else []


def _in_its_place(best: Hypothesis, simpler: Effect, null: Hypothesis) -> Hypothesis:
    """Fit another effect where that of a hypothesis is, from all else as it is there."""
    (effect,) = best.effects
    problem = null.problem.with_effect(simpler).at_sizes(best.problem.sizes)
    start = best.point_in(problem)
    place, found = (
        field_columns(each, of, each.place_fields)
        for each, of in ((simpler, problem), (effect, best.problem))
    )
    start[place] = best.fit.point[found]
    strength = field_columns(simpler, problem, simpler.absent[:1])
    starts = np.repeat(start[None], STRENGTHS, axis=0)
    starts[:, strength] = np.linspace(-WITHIN, WITHIN, STRENGTHS)[:, None]
    costs = problem.squares.objective().cost(starts)
    followed = starts[np.argsort(np.nan_to_num(costs, nan=np.inf))[:FOLLOWED]]
    sized = kept_with_sizes(problem, followed, DECREASING_ERRORS[-1:], best.as_rival)
    return replace(best, effects=(simpler,), near=followed[:0], **vars(sized))
