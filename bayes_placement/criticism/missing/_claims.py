"""What is claimed to be missing, one entry an effect: where, by which law, and what else fits."""

from collections.abc import Mapping

import jax
import numpy as np

from ..._shared.files import Json
from ..._shared.sites import is_unknown
from ...effects.effect import AtPlace, Effect, NetworkAttachment
from ...effects.library import EFFECTS, kind_of
from ...effects.registry import inserted, modulus
from ...laws.catalogue import canonical
from ...laws.law import Law, Scaled
from ._estimates import PERCENTILES, drawn_places, estimates, laplace, places_at
from ._hypotheses import Hypothesis
from ._parameter_estimate import ParameterEstimate, number_or_none
from ._posterior_odds import Comparison
from ._standing import Standing
from ._weighed import swapped
from .fitted_model import FittedModel

SCHEMA = 1
"""Version of the form of entries."""

LEAST = 0.01
"""Least share of the probability of an entry that another explanation must have."""


def claims(
    comparison: Comparison, best: Hypothesis, model: FittedModel, stands: Standing, none: float
) -> tuple[Json, ...]:
    """Return an entry for each effect of the best hypothesis, ready for a file.

    `none` is the probability of none of the candidates.
    """
    shares = _shares(comparison)
    entries = []
    for effect in best.effects:
        right = stands.probability_of_any(effect.name, none)
        entry = _entry(effect, best, model.parameters, shares[best.kinds], right)
        doubts = [doubt.words for doubt in stands.doubts.get(effect.name, ())]
        others = _equivalent(comparison, best, effect, shares, right)
        entries.append({**entry, "doubts": doubts, "equivalent": others})
    return tuple(entries)


def _shares(comparison: Comparison) -> dict[tuple[str, ...], float]:
    """Share of each collection of kinds among all hypotheses, by their odds."""
    shares: dict[tuple[str, ...], float] = {}
    odds = np.array([comparison.log_odds(h) for h in comparison.hypotheses])
    each = np.exp(odds - np.logaddexp.reduce(odds))
    for hypothesis, share in zip(comparison.hypotheses, each, strict=True):
        shares[hypothesis.kinds] = shares.get(hypothesis.kinds, 0.0) + float(share)
    return shares


def _equivalent(
    comparison: Comparison,
    best: Hypothesis,
    effect: Effect,
    shares: Mapping[tuple[str, ...], float],
    right: float,
) -> list[Json]:
    """Entries of what may stand in the place of an effect, all other kinds being the same."""
    entries = []
    for hypothesis in comparison.distinct():
        replaced, new = swapped(best.kinds, hypothesis.kinds)
        share = shares[hypothesis.kinds]
        is_alike = replaced == [kind_of(effect)] and len(new) == 1
        if is_alike and share > LEAST * shares[best.kinds]:
            other = next(each for each in hypothesis.effects if kind_of(each) in new)
            entries.append(_entry(other, hypothesis, estimates(hypothesis, None), share, right))
    return entries


def _entry(
    effect: Effect,
    hypothesis: Hypothesis,
    parameters: Mapping[str, ParameterEstimate],
    share: float,
    right: float,
) -> Json:
    """Lay out an effect with its share among the candidates, one of which is right as probably."""
    experiment = hypothesis.problem.experiment
    placed = next(each for each in experiment.effects if each.name == effect.name)
    numbers = {item.word: item for item in parameters.values() if item.effect == effect.name}
    means = {name: np.array([item.mean]) for name, item in parameters.items()}
    law = _law(effect.name, hypothesis)
    return {
        "name": kind_of(effect) if kind_of(effect) in EFFECTS else "network",
        "kind": kind_of(effect),
        "acts_on": placed.acts_on,
        "on": placed.setting(experiment.structure.modes, experiment.instruments),
        "direction": _direction(placed),
        "place_m": [place[0].tolist() for place in places_at(placed, experiment, means)],
        "place_95_m": [
            np.percentile(draws, PERCENTILES, axis=0).T.tolist()
            for draws in drawn_places(placed, hypothesis)
        ],
        "law": None if law is None else repr(law),
        "law_tree": None if law is None else canonical(law.tree()),
        "parameters": {word: item.to_json() for word, item in numbers.items()},
        "probability": number_or_none(share * right),
        "probability_among_candidates": number_or_none(share),
    }


def _direction(effect: Effect) -> list[float] | None:
    """Direction in which it acts; None for every one in which the structure moves."""
    direction = effect.direction if isinstance(effect, AtPlace) else None
    is_known = direction is not None and not any(map(is_unknown, direction))
    return np.array(direction, float).tolist() if is_known and direction else None


def _law(name: str, hypothesis: Hypothesis) -> Law | None:
    """Law of an effect with the means of its numbers, rounded as they are read; None without."""
    problem = hypothesis.problem
    drawn = problem.coordinates.named(laplace(hypothesis))
    means = {name: np.mean(values, axis=0) for name, values in drawn.items()}
    known = problem.experiment.fix(means)
    effect = next(each for each in known.effects if each.name == name)
    if isinstance(effect, inserted):
        law = effect.law
    elif isinstance(effect, NetworkAttachment | modulus):
        law = effect.network()
        law = law.law if isinstance(law, Scaled) and law.strength == 1.0 else law
    else:
        return None
    return jax.tree.map(lambda number: float(f"{float(number):.4g}"), law)
