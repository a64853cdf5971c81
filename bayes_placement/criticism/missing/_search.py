"""Search for the hypotheses worth comparing: single effects first, then one more at a time.

A kind may occur several times: where the best hypothesis has it, one more of it is tried as well.

The search is not greedy: several hypotheses are extended, each effect of the best one is removed
again and replaced, and each effect of the best few is looked for once more beside the others.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from ..._processes import nothing
from ...effects.effect import Effect
from ...effects.library import kind_of
from ...experiment.observe import Complex
from ...inference.standardised_residual import LOGARITHMIC_ERROR
from ._fitted_candidates import best_variants, extended, relocated
from ._hypotheses import Hypothesis, logarithmic_jacobian, takes_long
from ._posterior_odds import Comparison
from ._repeated import may_be_added
from ._scanned_candidates import Pair, ScannedCandidate, Tick
from ._screening_lines import at_sample, at_screening_lines, sample

VARIANTS = 4
"""Variants of one kind that are fitted, such as a mass on one member or another."""

VARIANTS_WITH_ERRORS = 2
"""The same where a model error is fitted too, which takes longer."""


class Breadth(NamedTuple):
    """Hypotheses that are extended, and the kinds of effects that are tried on each of them.

    The best `relocated` of those with one more effect are fitted from other places as well.
    """

    branches: int = 4
    kinds: int = 5
    relocated: int = 2


ALL = Breadth()

NARROW = Breadth(branches=2)
"""Where a model error already explains most."""


def single_effects(
    null: Hypothesis,
    effects: Sequence[Effect],
    tick: Tick,
    meanwhile: Callable[[], Any] = nothing,
) -> Comparison:
    """Every candidate alone: all are scanned, the most promising variants of each kind fitted."""
    variants = dict(Counter(kind_of(effect) for effect in effects))
    candidates, hypotheses = best_variants(null, effects, VARIANTS, tick, meanwhile)
    return Comparison([null, *hypotheses], variants, candidates)


def one_more_effect(
    comparison: Comparison,
    depth: int,
    tick: Tick,
    breadth: Breadth = ALL,
    meanwhile: Callable[[], Any] = nothing,
) -> Comparison:
    """Try one more effect on the best hypotheses of so many, and do meanwhile what is asked for.

    Then those of the best are replaced, and those of the best few looked for at other places: an
    effect that was fitted first, alone, may have drawn the second to a wrong one.
    """
    best = _branches(comparison, depth)
    deeper = comparison.with_hypotheses(
        extended(_pairs(comparison, best[: breadth.branches], breadth.kinds), tick, meanwhile)
    )
    replaced = extended(
        _pairs(deeper, _subsets_of_best(deeper, depth, breadth.kinds), breadth.kinds), tick
    )
    deeper = deeper.with_hypotheses(replaced)
    best = [hypothesis for hypothesis in deeper.distinct() if len(hypothesis.effects) == depth + 1]
    null = deeper.of(())
    few = best[: breadth.relocated]
    moved = dict(zip(few, relocated(few, null, tick), strict=True))
    return deeper._replace(hypotheses=[moved.get(known, known) for known in deeper.hypotheses])


def _branches(comparison: Comparison, depth: int) -> list[Hypothesis]:
    """Hypotheses of so many effects; with one that takes long only where it is the best."""
    first, *others = (each for each in comparison.distinct() if len(each.effects) == depth)
    return [first, *(each for each in others if not takes_long(each))]


def _subsets_of_best(comparison: Comparison, depth: int, most: int) -> list[Hypothesis]:
    """What is left of the best hypothesis without one of its effects, if not yet extended."""
    best = comparison.distinct()[0]
    if len(best.effects) != depth + 1:
        return []
    tried = {
        hypothesis.kinds
        for hypothesis in comparison.hypotheses
        if len(hypothesis.effects) == depth + 1
    }
    subsets = []
    for hypothesis in comparison.distinct():
        kinds = Counter(hypothesis.kinds)
        is_part = len(hypothesis.effects) == depth and kinds <= Counter(best.kinds)
        extensions = sum(kinds <= Counter(further) for further in tried)
        if is_part and extensions < most:
            subsets.append(hypothesis)
    return subsets


def _pairs(comparison: Comparison, branches: Sequence[Hypothesis], most: int) -> list[list[Pair]]:
    """Hypotheses to extend and the effects to extend them by, each collection of kinds once.

    Of a kind a few variants, since the best one alone, such as a mass that was removed, need not be
    the best one beside others. What takes long is added to the best hypothesis alone. A further
    effect of a kind of the best hypothesis is tried where it promises as much as the effects of
    other kinds, and takes the place of none of them.
    """
    null, best = comparison.of(()), comparison.distinct()[0]
    tried = {hypothesis.kinds for hypothesis in comparison.hypotheses}
    pairs: list[list[Pair]] = []
    for branch in branches:
        variants: dict[str, list[Pair]] = {}
        for candidate in _by_promise(branch, null, comparison.candidates):
            effect, kind = candidate.effect, kind_of(candidate.effect)
            extension = tuple(sorted((*branch.kinds, kind)))
            is_further = len(set(variants) - set(branch.kinds)) < most and extension not in tried
            if not (kind in variants or is_further):
                continue
            if effect.tried_last and branch is not branches[0]:
                continue
            if may_be_added(effect, candidate.problem, branch, best):
                tried.add(extension)
                variants.setdefault(kind, []).append((branch, effect))
        pairs += (of_kind[:VARIANTS] for of_kind in variants.values())
    return pairs


def _by_promise(
    branch: Hypothesis, null: Hypothesis, candidates: Sequence[ScannedCandidate]
) -> list[ScannedCandidate]:
    """Sort candidates by the least cost of the branch with their effect, to first order.

    Logarithms of FRFs add what effects do, as far as these do not act on each other: so the
    change that a scan saw without the branch is added to the residual of the branch. Each line
    counts by its noise, with what the branch misses: near the truth little but noise is left.
    """
    of_branch, of_null = logarithmic_jacobian(branch), logarithmic_jacobian(null)
    weight = at_sample(_weight(branch, of_branch.residual[0]))
    residual, before, slopes = map(
        sample, (of_branch.residual, of_null.residual, of_branch.slopes[0])
    )
    residual, slopes = weight * residual, weight * slopes
    curvature = slopes @ slopes.T + np.eye(len(slopes))

    def least_cost(candidate: ScannedCandidate) -> float:
        total = residual + weight * (candidate.scan.residual - before)
        pull = total @ slopes.T
        absorbed = np.einsum("bi,bi->b", pull, np.linalg.solve(curvature, pull.T).T)
        return float(np.nanmin(np.einsum("bn,bn->b", total, total) - absorbed))

    costs = [least_cost(candidate) for candidate in candidates]
    return [candidates[place] for place in np.argsort(costs, kind="stable")]


def _weight(branch: Hypothesis, residual: np.ndarray) -> np.ndarray:
    """Weight of each logarithmic residual: as plain ones have, with a further relative error.

    That error is what the branch misses besides noise: with it the reduced chi-square is 1. Without
    known noise, and where residuals are no logarithms, all weigh the same.
    """
    deviations = at_screening_lines(branch.problem).deviations()
    if deviations is None or not isinstance(branch.problem.experiment.observe, Complex):
        return np.ones_like(residual)
    plain, of_relative = deviations
    size = np.sqrt(2) * LOGARITHMIC_ERROR * of_relative  # half of a relative error in each part

    def weight(further: float) -> np.ndarray:
        return np.nan_to_num(size / np.hypot(plain, further * of_relative))

    def excess(further: float) -> float:
        return float(np.sum((residual * weight(further)) ** 2)) - branch.problem.count

    # With the whole residual as an error of the model there is no excess.
    most = np.sqrt(2) * LOGARITHMIC_ERROR * float(np.linalg.norm(residual))
    return weight(brentq(excess, 0.0, most) if excess(0.0) > 0 else 0.0)
