"""_branches: in, a fitted experiment and candidates; out, the hypotheses worth comparing.

Not known here: probabilities in words, files. The search is not greedy: several branches stay open,
and what the best hypothesis holds is taken away again and replaced.
"""

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from ...effects.effect import Effect
from ...effects.library import kind_of
from ._hypotheses import Hypothesis, Scanned, all_grown, all_scanned, finite, fitted
from ._odds import Pool

VARIANTS = 4
"""Variants of one kind that are fitted, such as a mass on one member or another."""

BRANCHES, SECONDS = 4, 5
"""Hypotheses that stay open, and the effects tried on each of them."""

Tick = Callable[[], None]


def singles(null: Hypothesis, candidates: Sequence[Effect], tick: Tick) -> Pool:
    """Every candidate alone: all are scanned, the most promising variants of each kind fitted."""
    variants: dict[str, int] = {}
    for effect in candidates:
        variants[kind_of(effect)] = variants.get(kind_of(effect), 0) + 1
    scanned = list(all_scanned([(null, effect) for effect in candidates], tick))
    found = finite(fitted(one) for one in _promising(scanned))
    return Pool([null, *found], variants, scanned)


def _promising(scanned: Sequence[Scanned]) -> list[Scanned]:
    """A few variants of each kind: those whose scan promises the least cost."""
    taken: Counter[str] = Counter()
    chosen = []
    for one in sorted(scanned, key=lambda one: one.promised):
        kind = kind_of(one.effect)
        taken[kind] += 1
        if taken[kind] <= VARIANTS:
            chosen.append(one)
    return chosen


def deeper(pool: Pool, depth: int, tick: Tick) -> Pool:
    """Try one more effect on the best hypotheses of a depth, then replace what the best holds."""
    open_branches = [one for one in pool.distinct() if len(one.effects) == depth][:BRANCHES]
    grown = all_grown(_pairs(pool, open_branches), tick)
    wider = pool._replace(hypotheses=[*pool.hypotheses, *grown])
    replaced = all_grown(_pairs(wider, _unopened(wider, depth)), tick)
    return wider._replace(hypotheses=[*wider.hypotheses, *replaced])


def _unopened(pool: Pool, depth: int) -> list[Hypothesis]:
    """What is left of the best hypothesis without one of its effects, if not yet a branch."""
    best = pool.distinct()[0]
    if len(best.effects) != depth + 1:
        return []
    tried = {one.kinds for one in pool.hypotheses if len(one.effects) == depth + 1}
    found = []
    for one in pool.distinct():
        part = len(one.effects) == depth and set(one.kinds) <= set(best.kinds)
        opened = sum(set(one.kinds) <= set(kinds) for kinds in tried) >= SECONDS
        if part and not opened:
            found.append(one)
    return found


def _pairs(pool: Pool, branches: Sequence[Hypothesis]) -> list[tuple[Hypothesis, Effect]]:
    null = next(one for one in pool.hypotheses if not one.effects)
    tried = {one.kinds for one in pool.hypotheses}
    pairs = []
    for branch in branches:
        promise = {id(one): _promise(branch, null, one) for one in pool.scanned}
        ranked = sorted(pool.scanned, key=lambda one: promise[id(one)])
        kinds: list[str] = []
        for one in ranked:
            kind = kind_of(one.effect)
            new = tuple(sorted((*branch.kinds, kind))) not in tried
            if kind not in kinds and kind not in branch.kinds and new and len(kinds) < SECONDS:
                kinds.append(kind)
                tried.add(tuple(sorted((*branch.kinds, kind))))
                pairs.append((branch, one.effect))
    return pairs


def _promise(branch: Hypothesis, null: Hypothesis, single: Scanned) -> float:
    """Least cost of the branch with the effect of another hypothesis, to first order.

    Logarithms of FRFs add what effects do, as far as these do not act on each other: so the
    change that a scan saw without the branch is added to what the branch leaves.
    """
    left, _, jacobian, _ = branch.problem.squares.jacobian(branch.fit.point[None], True)
    before, _ = null.problem.squares.residuals(null.fit.point[None], True)
    total = left + (single.scan.residual - before)
    slopes = jacobian[0]
    pull = total @ slopes.T
    curvature = slopes @ slopes.T + np.eye(len(slopes))
    absorbed = np.einsum("bi,bi->b", pull, np.linalg.solve(curvature, pull.T).T)
    return float(np.nanmin(np.einsum("bn,bn->b", total, total) - absorbed))
