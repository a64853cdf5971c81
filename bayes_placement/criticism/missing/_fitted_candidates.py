"""Effects added to hypotheses, in several processes.

What a process returns are arrays and numbers. Problems and data stay in each process.
"""

import functools
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ..._shared.parts import nothing
from ...effects.effect import Effect
from ...effects.library import kind_of
from ...inference.engines.empirical_bayes import Rival
from ...inference.residuals import Problem
from ..kept_fits import NO_RIVAL, fitted_in_processes
from ._at_channels import data_changed
from ._hypotheses import Hypothesis, finite
from ._scan import MOST, Scan
from ._scanned_candidates import (
    Pair,
    ScannedCandidate,
    Tick,
    fitted,
    points_of_scans,
    promising,
    scanned,
    with_free_names,
)
from ._suspicion import scores

FITTED = ("fit", "near", "deviations", "has_errors", "as_rival")
"""Fields of a hypothesis that are known from fitting it."""


class FittedFields(NamedTuple):
    """Fields of a fitted hypothesis, and sizes of its model error."""

    fields: Mapping[str, Any]
    sizes: Mapping[str, float]


class _Outcome(NamedTuple):
    """One more effect on a hypothesis: its scan, and its fit where it was fitted."""

    scan: Scan
    fit: FittedFields | None
    scores: pd.DataFrame | None


class Extended(NamedTuple):
    """Effects on hypotheses, each scanned, and those of them that were fitted."""

    candidates: list[ScannedCandidate]
    hypotheses: list[Hypothesis]


def best_variants(
    base: Hypothesis,
    effects: Sequence[Effect],
    most: int,
    tick: Tick,
    meanwhile: Callable[[], object] = nothing,
) -> Extended:
    """Scan effects on a hypothesis and fit a few variants of each kind, the most promising first.

    Those that change a few channels alone are not fitted, see `fits_of_channels`.

    At most so many variants of a kind are fitted. `tick` is called for each effect; `meanwhile` is
    what this process does first, once helpers have begun.
    """
    variants = defaultdict(list)
    for effect in effects:
        variants[kind_of(effect), data_changed(base, effect) is None].append((base, effect))
    points = points_of_scans(effects)
    groups = [_Group(pairs, most if is_whole else 0) for (_, is_whole), pairs in variants.items()]
    tried = _tried(groups, points, tick, True, meanwhile)
    by_promise = sorted(tried, key=lambda candidate_and_fit: candidate_and_fit[0].predicted_cost)
    return Extended(
        [candidate for candidate, _ in tried],
        finite(hypothesis for _, hypothesis in by_promise if hypothesis is not None),
    )


def fits_of_channels(
    candidates: Sequence[ScannedCandidate], most: int, may_win: Callable[[np.ndarray], bool]
) -> list[Hypothesis]:
    """Fit a few variants of each kind of those that change a few channels alone.

    `may_win` says whether any effect on these data may.
    """
    pairs = [(each, data_changed(each.base, each.effect)) for each in candidates]
    changed = {id(each): data for each, data in pairs if data is not None}
    of_channels = [each for each in candidates if id(each) in changed]
    chosen = defaultdict(list)
    for each in promising(of_channels, most):
        if may_win(changed[id(each)]):
            chosen[kind_of(each.effect)].append(each)
    groups = list(chosen.values())
    return finite(each for fits in _fits_of(groups, NO_RIVAL) for each in fits)


def fits_against(candidates: Sequence[ScannedCandidate], rival: Rival) -> list[Hypothesis]:
    """Fit candidates that were scanned, in their order; with model error, see `with_errors`."""
    return [fit for (fit,) in _fits_of([[candidate] for candidate in candidates], rival)]


def _fits_of(groups: Sequence[Sequence[ScannedCandidate]], rival: Rival) -> list[list[Hypothesis]]:
    """Fits of groups of candidates, of each group in one process."""
    tasks = [
        ([(each.base, each.effect) for each in group], [each.scan for each in group], rival)
        for group in groups
    ]
    fits = fitted_in_processes(_fits, tasks)
    return [
        [_as_hypothesis(*pair) for pair in zip(group, found, strict=True)]
        for group, found in zip(groups, fits, strict=True)
    ]


def _fits(pairs: Sequence[Pair], scans: Sequence[Scan], rival: Rival) -> list[FittedFields]:
    """What one process finds of candidates that were scanned."""
    known = [(*pair, scan) for pair, scan in zip(pairs, scans, strict=True)]
    return [fitted_fields(fitted(ScannedCandidate(*each), rival)) for each in known]


def only_scanned(pairs: Sequence[Pair], tick: Tick) -> list[ScannedCandidate]:
    """Scan effects on hypotheses, in several processes, those of one kind in one."""
    of_kinds = defaultdict(list)
    for pair in pairs:
        of_kinds[kind_of(pair[1])].append(pair)
    points = points_of_scans(effect for _, effect in pairs)
    tried = _tried([_Group(of_kind, 0) for of_kind in of_kinds.values()], points, tick)
    return [candidate for candidate, _ in tried]


def extended(
    groups: Sequence[Sequence[Pair]], tick: Tick, meanwhile: Callable[[], object] = nothing
) -> list[Hypothesis]:
    """Fit hypotheses with one more effect; those without a finite density are left out.

    Of each group, all of one kind, the most promising pair is fitted. `tick` is called for each
    effect; `meanwhile` is what this process does first, once helpers have begun.
    """
    points = points_of_scans(effect for group in groups for _, effect in group)
    tried = _tried([_Group(group, 1) for group in groups], points, tick, meanwhile=meanwhile)
    return finite(hypothesis for _, hypothesis in tried if hypothesis is not None)


def relocated(hypotheses: Sequence[Hypothesis], null: Hypothesis, tick: Tick) -> list[Hypothesis]:
    """Fit each effect in turn from its best places beside the others, where these are fitted.

    A descent moves all effects together. From the mirror image of a place, or from a place that
    was the best one without the others, it leads nowhere else.

    All have as many effects; `tick` is called once for each of these. Of each hypothesis comes back
    the one of the greatest evidence, the given one included.
    """
    best = list(hypotheses)
    for effects in zip(*(hypothesis.effects for hypothesis in hypotheses), strict=True):
        pairs = [
            (without(hypothesis, effect.name, null), effect)
            for hypothesis, effect in zip(best, effects, strict=True)
        ]
        points = {kind_of(effect): MOST for effect in effects}
        tried = _tried([_Group([pair], 1) for pair in pairs], points, tick)
        best = [
            max([hypothesis, *finite([moved] if moved else [])], key=_log_evidence)
            for hypothesis, (_, moved) in zip(best, tried, strict=True)
        ]
    return best


def _log_evidence(hypothesis: Hypothesis) -> float:
    return hypothesis.fit.log_evidence


def without(hypothesis: Hypothesis, name: str, null: Hypothesis) -> Hypothesis:
    """Return a hypothesis less one of its effects, all else where it is."""
    others = tuple(effect for effect in hypothesis.effects if effect.name != name)
    problem = functools.reduce(Problem.with_effect, others, null.problem)
    fit = hypothesis.fit._replace(point=hypothesis.point_in(problem))
    return replace(hypothesis, effects=others, problem=problem, fit=fit)


class _Group(NamedTuple):
    """Hypotheses and effects of one kind, and how many of them are fitted at most."""

    pairs: Sequence[Pair]
    most: int


def _tried(
    groups: Sequence[_Group],
    points: Mapping[str, int],
    tick: Tick,
    are_scored: bool = False,
    meanwhile: Callable[[], object] = nothing,
) -> list[tuple[ScannedCandidate, Hypothesis | None]]:
    """Scan effects on hypotheses in groups of one kind, and fit the best few of each group."""
    named = [with_free_names(group.pairs) for group in groups]
    order = sorted(range(len(named)), key=lambda number: -len(named[number]))
    tasks = [(named[number], points, groups[number].most, are_scored) for number in order]

    def done(task: int) -> None:
        for _ in tasks[task][0]:
            tick()

    fits = fitted_in_processes(_outcomes, tasks, done, meanwhile)
    outcomes = dict(zip(order, fits, strict=True))
    return [
        _received(pair, outcome)
        for number, pairs in enumerate(named)
        for pair, outcome in zip(pairs, outcomes[number], strict=True)
    ]


def _outcomes(
    pairs: Sequence[Pair], points: Mapping[str, int], most: int, are_scored: bool
) -> list[_Outcome]:
    """What one process finds of variants of one kind."""
    candidates = list(scanned(pairs, lambda: None, points))
    best = {id(candidate) for candidate in promising(candidates, most)}
    fits = [fitted_fields(fitted(each)) if id(each) in best else None for each in candidates]
    known = scores(pairs[0][0], candidates) if are_scored else [None] * len(candidates)
    return [
        _Outcome(candidate.scan, fit, score)
        for candidate, fit, score in zip(candidates, fits, known, strict=True)
    ]


def fitted_fields(hypothesis: Hypothesis) -> FittedFields:
    """Return what is known of a hypothesis from fitting it."""
    return FittedFields(
        {name: getattr(hypothesis, name) for name in FITTED}, hypothesis.problem.sizes
    )


def _received(pair: Pair, outcome: _Outcome) -> tuple[ScannedCandidate, Hypothesis | None]:
    """What was found, with the problem of this process."""
    base, effect = pair
    candidate = ScannedCandidate(base, effect, outcome.scan, outcome.scores)
    return candidate, None if outcome.fit is None else _as_hypothesis(candidate, outcome.fit)


def _as_hypothesis(candidate: ScannedCandidate, found: FittedFields) -> Hypothesis:
    """What was found, with the problem of this process."""
    fields, sizes = found
    problem = candidate.problem
    at_sizes = problem.at_sizes(sizes) if fields["has_errors"] else problem
    return Hypothesis((*candidate.base.effects, candidate.effect), at_sizes, **fields)
