"""Decide what is claimed to be missing from a table of rows alone: pure, in any order of rows."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from ..._shared.arguments import arguments_checked
from ..._shared.errors import InputError
from ..._shared.files import Json
from ..._shared.reprs import with_short_repr
from ..check._edges import EDGE
from ._weighed import Weighed, numbered_kind
from .table import AS_STATED, Policy, Row, TableOfFits

FAILS = "the model still fails its check"
"""A doubt that a verdict says by itself."""


class Doubt(NamedTuple):
    """Why a claim may be wrong although no candidate explains the data better.

    Words are the reason, after "but"; the p-value is the probability of as much reason for doubt
    where the claim is right.
    """

    words: str
    p_value: float

    @property
    def probability(self) -> float:
        """Probability that the claim is right, even odds before.

        -e p log p is the least Bayes factor of a p-value: Sellke, Bayarri and Berger, American
        Statistician 55 (2001), doi:10.1198/000313001300339950.
        """
        p = float(np.clip(self.p_value, np.finfo(float).tiny, np.exp(-1.0)))
        factor = -np.exp(1.0) * p * np.log(p)
        return float(factor / (1 + factor))


@with_short_repr
class Decision(NamedTuple):
    """What is claimed.

    Parameters
    ----------
    kinds
        Kinds of the effects that are claimed, sorted; none where nothing is.
    probabilities
        Posterior probability of each kind, of `nothing_missing` and of `none_of_these`.
    confounded
        Pairs of kinds that these data do not distinguish.
    unexplained
        Whether what is claimed still fails its check.
    exact_fails
        Whether the model as given, without model error, fails its check.
    reasons
        Why no more is claimed, in short words.
    doubts
        What makes each effect that is claimed doubtful, by its name.
    told_as_missing
        Kinds that are more than the best of several; the others only reduce the misfit.
    steps
        Numbers of the rows from the model as given to what is claimed, one effect more each time.

    Examples
    --------
    >>> decision = bp.decide(ledger.rows)
    >>> decision.kinds, decision.unexplained, decision.reasons
    (('point_mass',), False, ())
    """

    kinds: tuple[str, ...]
    probabilities: dict[str, float]
    confounded: tuple[tuple[str, str], ...]
    unexplained: bool
    exact_fails: bool
    reasons: tuple[str, ...]
    doubts: Mapping[str, tuple[Doubt, ...]]
    told_as_missing: tuple[str, ...]
    steps: tuple[int, ...]


@arguments_checked
def decide(table: TableOfFits | Json, policy: Policy = AS_STATED) -> Decision:
    """Decide what is missing from numbers that are stored: nothing is fitted.

    The same table and policy give the same decision, in any order of rows. `table` of `ledger.json`
    is such a table, so that a search is decided again by other thresholds in no time.

    Parameters
    ----------
    table
        Numbers of every fitted hypothesis, one of them without effects; or the same as of JSON.
    policy
        Thresholds and prior probabilities.

    Raises
    ------
    InputError
        If it is no table, or no row is without effects.

    Examples
    --------
    >>> import json
    >>> stored = json.loads(json.dumps(ledger.to_json()))
    >>> bp.decide(stored["table"], bp.Policy(**stored["policy"])).kinds == ledger.verdict
    True
    >>> often_larger = bp.decide(stored["table"], bp.Policy(prior_of_none=0.9))
    >>> round(often_larger.probabilities["none_of_these"], 2)
    0.21
    """
    table = table if isinstance(table, TableOfFits) else TableOfFits.from_json(table)
    if all(row.kinds for row in table.rows):
        raise InputError(
            f"A table of {len(table.rows)} rows was given, each with an effect; one without is "
            "needed, since effects are compared with the model as given: "
            "bp.decide(ledger.to_json()['table'])."
        )
    weighed = Weighed(table, policy)
    claimed, reasons, vetoed = _claimed(weighed)
    steps = weighed.steps_to(claimed)
    way = [table.rows[number] for number in steps]
    last = way[-1]
    probabilities = weighed.probabilities(last.kinds, [table.rows[n].kinds for n in vetoed])
    unexplained = last.p_value < policy.level
    fit = bool(last.sizes), last.is_noise_known, unexplained
    odds = {kind: probabilities[numbered_kind(kind, last.kinds.count(kind))] for kind in last.kinds}
    return Decision(
        kinds=last.kinds,
        probabilities=probabilities,
        confounded=tuple(weighed.confounded()),
        unexplained=unexplained,
        exact_fails=way[0].p_value_when_exact < policy.level,
        reasons=tuple(reasons),
        doubts={name: tuple(_doubts(name, way, policy)) for name in last.effects},
        told_as_missing=tuple(kind for kind in odds if is_missing(*fit, odds[kind], policy)),
        steps=tuple(steps),
    )


class _Claimed(NamedTuple):
    """The row that is claimed, why no more is, and those of more effects that do not hold."""

    number: int
    reasons: list[str]
    vetoed: Sequence[int] = ()


def _claimed(weighed: Weighed) -> _Claimed:
    """What is claimed: nothing where the model passes its check.

    Chi2 over many lines passes although an effect shows in a few: there, odds of twice strong
    evidence decide. Where a model error is allowed, effects that do not hold are left out, the last
    one first.
    """
    rows, policy, best = weighed.rows, weighed.policy, weighed.best
    none = weighed.of(())
    reasons = []
    if is_unexplained(weighed.table.baseline, policy):
        return _Claimed(none, ["the baseline is not explained by the model"])
    if best != weighed.ranked[0]:
        reasons.append(f"the evidence for {_named(rows[weighed.ranked[0]])} is not strong")
    weak = weighed.odds[best] - weighed.odds[none] < np.log(policy.strong_where_passing)
    if rows[best].kinds and not rows[none].has_errors and rows[none].passes(policy) and weak:
        return _Claimed(none, [*reasons, "the model as given passes its check"])
    if not rows[best].has_errors:
        return _Claimed(best, reasons)
    vetoed = []
    *fewer, claimed = weighed.steps_to(best)
    while fewer and (objection := next(objections(weighed, claimed, fewer[-1]), "")):
        reasons.append(f"{_named(rows[claimed])} {objection}")
        vetoed.append(claimed)
        claimed = fewer.pop()
    return _Claimed(claimed, reasons, vetoed)


def is_unexplained(baseline: Row | None, policy: Policy) -> bool:
    """Whether a model does not explain its baseline: nothing can be said of what came since.

    It fails its check, or needs as large a model error as its prior allows.
    """
    return baseline is not None and (baseline.fails(policy) or bool(baseline.errors_at_edge))


def objections(weighed: Weighed, number: int, fewer: int) -> Iterator[str]:
    """Why a claim does not hold where a model error is allowed; nothing where it does.

    The form of a model error is assumed, so that evidence alone does not suffice with it: the
    effects must also predict held-out data better than fewer of them, none of them may be only the
    best of several, nor sit at an edge of its prior, and each must explain more than it leaves to
    the model error: scatter along a structure looks a little like many effects. Of two states,
    their difference shows what is new: less is asked there. A model error that is as large as its
    prior allows is no rival of what acts on the structure, and no judge of what two states share:
    the model is wrong as a whole.
    """
    row, before, policy = weighed.rows[number], weighed.rows[fewer], weighed.policy
    if row.states == 1:
        if others := as_good_elsewhere(weighed, number):
            yield (
                "is not the only one that explains the data beside a model error: so does "
                f"{' or '.join(others)}"
            )
        if not _explains_most(row, before, policy):
            yield (
                f"removes no more than {policy.explained:.0%} of the misfit, and the model error "
                "would have to take up the rest"
            )
    if row.errors_at_edge and (row.states == 2 or row.on_structure):
        kind = row.errors_at_edge[0].split(".")[1].replace("_", " ")
        yield (
            f"needs as large a model error of {kind} as its prior allows: supports and dimensions "
            "come first"
        )
    for name, side in sorted(_sides_of_edges(row, policy)):
        yield (
            f"has the size of {name} at the {side} edge of its prior: another cause is likely, or "
            "the prior is too narrow"
        )
    if not predicts_better(row, before, policy):
        yield "predicts held-out data no better" if row.held_out else "was held against no data"


def _sides_of_edges(row: Row, policy: Policy) -> dict[tuple[str, str], float]:
    """Effects whose size piles up at a side of its prior, and by how much more than there."""
    return {(name, side): ratio for name, side, ratio in row.edges if ratio >= policy.piled_up}


def as_good_elsewhere(weighed: Weighed, number: int) -> list[str]:
    """What acts elsewhere and explains the data as well; another law there is told beside."""
    kinds = weighed.rows[number].kinds
    return [other for kind, other in weighed.confounded_elsewhere() if kind in kinds]


def predicts_better(row: Row, before: Row, policy: Policy) -> bool:
    """Whether a row predicts held-out lines better than that of fewer effects.

    By more than twice the standard error, since a gain of one block alone may be of its errors; or
    by Wilcoxon's signed ranks at the same level, since an effect that shows in a few blocks gains
    so much there that the error is large as well.
    """
    gain, error = gain_held_out(row, before)
    if not error > 0:
        return gain > 0
    from scipy.stats import wilcoxon  # it takes long to import

    by_ranks = wilcoxon(np.subtract(row.held_out, before.held_out), alternative="greater").pvalue
    errors = policy.held_out_errors
    return bool(gain > errors * error or by_ranks < ndtr(-errors))


def _explains_most(row: Row, before: Row, policy: Policy) -> bool:
    """Whether the last effect explains more of the misfit than what is left to model error.

    A forgotten mass or a soft spot that is as large as the scatter of the structure is a part of
    that scatter, although an effect at its place fits it well.
    """
    # Not of NaN: not fitted without errors, or too few lines to tell what is smooth.
    return not before.misfit - row.misfit <= policy.explained * before.misfit


def gain_held_out(row: Row, other: Row) -> tuple[float, float]:
    """Gain of the mean log density of held-out data, and its standard error over the blocks.

    NaN where there are no two blocks.
    """
    if min(len(row.held_out), len(other.held_out)) < 2:
        return float("nan"), float("nan")
    gains = np.subtract(row.held_out, other.held_out)
    return float(np.mean(gains)), float(np.std(gains, ddof=1) / np.sqrt(gains.size))


def is_missing(
    has_errors: bool, is_noise_known: bool, unexplained: bool, probability: float, policy: Policy
) -> bool:
    """Whether an effect of a claim is more than the best of several.

    It is as probable as not, at least. Where a model error is allowed, the check passes as well:
    a larger error is among the rivals already. Where the noise is not known, residuals that scatter
    as noise does are enough.
    """
    if not is_noise_known:
        return not unexplained
    return probability >= policy.doubted and not (has_errors and unexplained)


def _doubts(name: str, way: list[Row], policy: Policy) -> Iterator[Doubt]:
    """What makes an effect of the last row doubtful."""
    for (effect, side), ratio in _sides_of_edges(way[-1], policy).items():
        if effect == name:
            # By Markov's inequality a right prior leaves so much at an edge as seldom.
            yield Doubt(f"its size sits at the {side} edge of its prior", 1 / ratio)
    # An effect may stand for nothing before the next one is there: what was before it counts.
    number = next(n for n, row in enumerate(way) if name in row.effects)
    gain, error = gain_held_out(way[-1], way[max(0, number - 1)])
    if gain < -policy.held_out_errors * error < 0:
        yield Doubt("held-out data are predicted worse with it", float(ndtr(gain / error)))
    if way[-1].errors_at_edge:
        yield Doubt("the model error is as large as its prior allows", EDGE)
    if way[-1].p_value < policy.level:
        yield Doubt(FAILS, way[-1].p_value)


def _named(row: Row) -> str:
    return " + ".join(row.kinds)
