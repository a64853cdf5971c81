"""Search for the hypotheses worth comparing: single effects first, then one more at a time.

A kind may occur several times: where the best hypothesis has it, one more of it is tried as well.

The search is not greedy: several hypotheses are extended, each effect of the best one is removed
again and replaced, and each effect of the best few is looked for once more beside the others.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..._shared.parts import nothing
from ...effects.effect import Effect
from ...effects.library import kind_of
from ...experiment.observe import Complex
from ...inference.output_residuals import LOGARITHMIC_ERROR
from ..reach._left_out import LeftOut
from ..screening_lines import Thinned, at_sample, at_screening_lines, sample
from ._fitted_candidates import best_variants, extended, fits_of_channels, relocated, without
from ._hypotheses import Hypothesis, logarithmic_jacobian, takes_long
from ._linear import Linear
from ._posterior_odds import Comparison, explains
from ._repeated import may_be_added
from ._rows import row_of
from ._scanned_candidates import Pair, ScannedCandidate, Tick, scanned
from ._swapped_pairs import is_swap, likeliest
from .table import AS_STATED, Policy

VARIANTS = 4
"""Variants of one kind that are fitted, such as a mass on one member or another."""

VARIANTS_WITH_ERRORS = 2
"""The same where a model error is fitted too, which takes longer."""

AT_FIRST = 2
"""Most promising ones, fitted with a model error before what is given up far behind the best."""


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
    meanwhile: Callable[[], object] = nothing,
) -> Comparison:
    """Every candidate alone: all are scanned, the most promising variants of each kind fitted."""
    variants = dict(Counter(kind_of(effect) for effect in effects))
    tried, swaps = likeliest(null, effects, VARIANTS), [*filter(is_swap, effects)]
    candidates, hypotheses = best_variants(null, tried, VARIANTS, tick, meanwhile)
    return Comparison([null, *hypotheses], variants, candidates, swaps=swaps)


def with_channels(comparison: Comparison, level: float, needs_all: bool = False) -> Comparison:
    """Fit the most promising variants of the kinds of effects that change a few channels alone.

    Where the best hypothesis explains the data, those alone that may win. The evidence of an effect
    is at most that of all data but those that it changes, times the greatest density of these.
    Where that stays behind the best by more than the odds that decide, and the check fails even
    without these data, the effect is neither claimed, nor confounded, nor an alternative.

    The level is the probability that a correct model fails its check. All are fitted where a model
    error changes what may win.
    """
    null, best = comparison.of(()), comparison.best()
    without = LeftOut(null.problem, null.fit)
    least = comparison.log_odds(best) - np.log(AS_STATED.strong_where_passing)
    needs_all = needs_all or not explains(best, level)

    def may_win(data: np.ndarray) -> bool:
        left = np.isin(np.arange(len(null.residual)), data)
        row = row_of(null)._replace(squares=without.squares(left))
        is_near = without.most_evidence(left) > least
        return bool(needs_all or row.passes(Policy(level=level)) or is_near)

    return comparison.with_hypotheses(fits_of_channels(comparison.candidates, VARIANTS, may_win))


def one_more_effect(
    comparison: Comparison,
    depth: int,
    tick: Tick,
    breadth: Breadth = ALL,
    meanwhile: Callable[[], object] = nothing,
    is_given_up: Callable[[Effect], bool] = lambda _: False,
) -> Comparison:
    """Try one more effect on the best hypotheses of so many, and do meanwhile what is asked for.

    Then those of the best are replaced, and those of the best few looked for at other places: an
    effect that was fitted first, alone, may have drawn the second to a wrong one.

    Of the kinds that promise most those effects are left out that are given up.
    """
    best = _branches(comparison, depth)
    kinds = breadth.kinds, is_given_up
    deeper = comparison.with_hypotheses(
        extended(_pairs(comparison, best[: breadth.branches], *kinds), tick, meanwhile)
    )
    subsets = _subsets_of_best(deeper, depth, breadth.kinds)
    deeper = deeper.with_hypotheses(extended(_pairs(deeper, subsets, *kinds), tick))
    best = [hypothesis for hypothesis in deeper.distinct() if len(hypothesis.effects) == depth + 1]
    null = deeper.of(())
    few = best[: breadth.relocated]
    moved = dict(zip(few, relocated(few, null, tick), strict=True))
    return deeper._replace(hypotheses=[moved.get(known, known) for known in deeper.hypotheses])


def with_listed_replaced(comparison: Comparison, tick: Tick, breadth: Breadth = ALL) -> Comparison:
    """Replace each listed effect of the best hypothesis by others, where it has a network too.

    It came first, alone, and stood for a part of what the network does: beside that a simpler one
    may be enough. With a model error, where fits take minutes, it stays.
    """
    best, null = comparison.best(), comparison.of(())
    listed = [effect for effect in best.effects if kind_of(effect) not in comparison.networks]
    if best.has_errors or not listed or len(listed) == len(best.effects):
        return comparison
    rests = [without(best, effect.name, null) for effect in listed]
    return comparison.with_hypotheses(extended(_pairs(comparison, rests, breadth.kinds), tick))


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


def _pairs(
    comparison: Comparison,
    branches: Sequence[Hypothesis],
    most: int,
    is_given_up: Callable[[Effect], bool] = lambda _: False,
) -> list[list[Pair]]:
    """Hypotheses to extend and the effects to extend them by, each collection of kinds once.

    Of a kind a few variants, since the best one alone, such as a mass that was removed, need not be
    the best one beside others. What takes long is added to the best hypothesis alone. A further
    effect of a kind that is there is tried where it promises as much as the effects of other kinds,
    and takes the place of none of them.
    """
    null = comparison.of(())
    tried = {hypothesis.kinds for hypothesis in comparison.hypotheses}
    pairs: list[list[Pair]] = []
    for branch in branches:
        variants: dict[str, list[Pair]] = {}
        candidates = [*comparison.candidates, *_further_swaps(comparison, branch)]
        for candidate in _by_promise(branch, null, candidates):
            effect, kind = candidate.effect, kind_of(candidate.effect)
            extension = tuple(sorted((*branch.kinds, kind)))
            is_among_best = len(set(variants) - set(branch.kinds)) < most
            # A scan without the branch saw the first of several modes alone.
            is_one_more = effect.may_coincide and kind in branch.kinds
            is_further = (is_among_best or is_one_more) and extension not in tried
            if not (kind in variants or is_further):
                continue
            if effect.takes_long and branch is not branches[0]:
                continue
            if may_be_added(effect, candidate.problem, branch):
                tried.add(extension)
                of_kind = variants.setdefault(kind, [])
                if not is_given_up(effect):
                    of_kind.append((branch, effect))
        pairs += (of_kind[:VARIANTS] for of_kind in variants.values() if of_kind)
    return pairs


def _further_swaps(comparison: Comparison, branch: Hypothesis) -> list[ScannedCandidate]:
    """Swapped pairs that leave least beside the effects of a branch, if no candidates yet."""
    known = {id(candidate.effect) for candidate in comparison.candidates}
    swaps = likeliest(branch, comparison.swaps, VARIANTS)
    null = comparison.of(())
    further = [(null, effect) for effect in swaps if id(effect) not in known]
    return [*scanned(further, lambda: None)]


def _by_promise(
    branch: Hypothesis, null: Hypothesis, candidates: Sequence[ScannedCandidate]
) -> list[ScannedCandidate]:
    """Sort candidates by the least cost of the branch with their effect, to first order.

    Logarithms of FRFs add what effects do, as far as these do not act on each other: so the
    change that a scan saw without the branch is added to the residual of the branch. Each line
    counts by its noise, with what the branch misses: near the truth little but noise is left.
    """
    of_branch, before = logarithmic_jacobian(branch), logarithmic_jacobian(null).residual[0]
    residual, turn = of_branch.residual[0], _full_turn(branch)
    weight, unchanged = _weight(branch, residual), residual - before
    everywhere = Linear(weight * residual, weight * of_branch.slopes[0])
    sampled = Linear(sample(everywhere.residual), sample(everywhere.slopes))

    def gain(candidate: ScannedCandidate) -> float:
        data = candidate.scan.data
        if data.size:
            changed = _within_a_turn(candidate.scan.residual + unchanged[data], turn[data])
            return everywhere.gain(weight[data] * changed, data)
        changed = _within_a_turn(candidate.scan.residual + sample(unchanged), sample(turn))
        return sampled.gain(at_sample(weight) * changed)

    gains = [gain(candidate) for candidate in candidates]
    return [candidates[place] for place in np.argsort(np.negative(gains), kind="stable")]


def _full_turn(branch: Hypothesis) -> np.ndarray:
    """Logarithmic residual of a full turn of the phase; zero of residuals that are no phases."""
    screened = at_screening_lines(branch.problem)
    turns = []
    for state in screened.problem.states:
        turn = np.zeros(np.shape(state.data.z))
        if isinstance(state.experiment.observe, Complex):
            turn[..., 1, :] = 2 * np.pi / LOGARITHMIC_ERROR
        turns.append(turn.ravel())
    return np.concatenate(turns) * (screened.weight if isinstance(screened, Thinned) else 1.0)


def _within_a_turn(residual: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Residuals with phases between half a turn on either side: sums of two may lie beyond."""
    return residual - turn * np.round(residual / np.where(turn > 0, turn, np.inf))


def _weight(branch: Hypothesis, residual: np.ndarray) -> np.ndarray:
    """Weight of each logarithmic residual: as plain ones have, with a further relative error.

    That error is what the branch misses besides noise: with it the reduced chi-square is 1. Without
    known noise, and where residuals are no logarithms, all weigh the same.
    """
    deviations = at_screening_lines(branch.problem).deviations()
    if deviations is None or not isinstance(branch.problem.experiment.observe, Complex):
        return np.ones_like(residual)
    from scipy.optimize import brentq  # it takes long to import

    plain, of_relative = deviations
    size = np.sqrt(2) * LOGARITHMIC_ERROR * of_relative  # half of a relative error in each part

    def weight(further: float) -> np.ndarray:
        return np.nan_to_num(size / np.hypot(plain, further * of_relative))

    def excess(further: float) -> float:
        return float(np.sum((residual * weight(further)) ** 2)) - branch.problem.count

    # With the whole residual as an error of the model there is no excess.
    most = np.sqrt(2) * LOGARITHMIC_ERROR * float(np.linalg.norm(residual))
    return weight(brentq(excess, 0.0, most) if excess(0.0) > 0 else 0.0)
