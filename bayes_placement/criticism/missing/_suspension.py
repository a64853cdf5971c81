"""A free beam that hangs on two springs: neither alone holds it, so that both are tried at once.

A search that adds one effect at a time finds no first one there: on one spring the beam still
swings about it, at another frequency than all that was measured.
"""

import functools
import itertools
from collections import ChainMap
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeGuard

import numpy as np
from scipy.special import ndtri

from ..._shared.sites import is_unknown
from ...effects.effect import Effect
from ...effects.ground_spring import GroundSpring
from ...inference.residuals import Problem
from ...modes.ports import is_beam
from ..reach._ports import field_columns
from ..screening_lines import at_screening_lines
from ._descents import fit_grown
from ._hypotheses import Hypothesis, finite
from ._mounts import on_mounts
from ._networks import priors_of_networks
from ._posterior_odds import Comparison

PLACES, STIFFNESSES = 12, 10
"""Places of each spring, and its stiffnesses, of equal probability in the prior."""

FOLLOWED = 8
"""Pairs that are followed from each start of all else."""


def as_they_are(*hypotheses: Hypothesis) -> Sequence[Hypothesis]:
    """Return the hypotheses."""
    return hypotheses


def with_suspended(
    comparison: Comparison,
    exact: Comparison,
    networks: bool,
    fits: Callable[..., Sequence[Hypothesis]] = as_they_are,
) -> Comparison:
    """Add a free beam on two springs, with and without loss; nothing of other structures.

    `exact` are hypotheses without model error, with springs to the ground among the candidates;
    `fits` makes of such what is compared. What is in no list is added where networks are tried.
    """
    null = exact.of(())
    modes = null.problem.experiment.structure.modes
    effects = (candidate.effect for candidate in exact.candidates)
    spring = next(filter(_may_be_anywhere, effects), None)
    if spring is None or not is_beam(modes) or modes.rigid_body_modes < 2:
        return comparison
    hung = [h for h in _hung(null, spring) if networks or {*h.kinds} <= exact.variants.keys()]
    priors = (priors_of_networks(each, comparison) for each in hung)
    return comparison.with_hypotheses(finite(fits(*hung)), ChainMap(*priors))


def _may_be_anywhere(effect: Effect) -> TypeGuard[GroundSpring]:
    if not isinstance(effect, GroundSpring):
        return False
    return is_unknown(effect.at) and is_unknown(effect.stiffness)


@functools.lru_cache(maxsize=2)  # asked for without and with a model error
def _hung(null: Hypothesis, spring: GroundSpring) -> tuple[Hypothesis, ...]:
    on_two = _on_two(null, spring)
    return on_two, *on_mounts([on_two], null)


def _on_two(null: Hypothesis, spring: GroundSpring) -> Hypothesis:
    effects = spring, replace(spring, name=f"{spring.name}_2")
    problem = null.problem.with_effect(effects[0]).with_effect(effects[1])
    bases = null.point_in(problem), np.zeros(problem.dimension)
    best = np.concatenate([_best_pairs(problem, effects, base) for base in bases])
    return Hypothesis(effects, problem, *fit_grown(problem, best, best[::FOLLOWED]))


def _best_pairs(problem: Problem, effects: Sequence[GroundSpring], base: np.ndarray) -> np.ndarray:
    """Points of least cost among all pairs of places and stiffnesses, all else as in one point."""
    shares = [(np.arange(count) + 0.5) / count for count in (PLACES, STIFFNESSES)]
    places, stiffnesses = map(ndtri, shares)
    rows = [
        (*ends, *sizes)
        for ends in itertools.combinations(places, 2)
        for sizes in itertools.product(stiffnesses, repeat=2)
    ]
    columns = [
        column
        for field in ("at", "stiffness")
        for each in effects
        for column in field_columns(each, problem, [field])
    ]
    points = np.repeat(base[None], len(rows), axis=0)
    points[:, columns] = rows
    costs = at_screening_lines(problem).squares.objective(logarithmic=True).cost(points)
    return points[np.argsort(np.nan_to_num(costs, nan=np.inf), kind="stable")[:FOLLOWED]]
