"""Posterior odds of the rows of a table, and probabilities of each kind of effect."""

from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Sequence
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from .table import AS_STATED, Box, Policy, Row, TableOfFits

NOTHING, NONE = "nothing_missing", "none_of_these"


def log_prior_of_count(count: int, policy: Policy) -> float:
    """Log prior probability of so many effects, halved by each further one."""
    return float((count + 1) * np.log(policy.prior_of_further_effect))


def log_odds(row: Row, policy: Policy) -> float:
    """Log evidence plus log prior probability of its effects.

    A model error may not have the form of the true one. Beside it, the error may therefore be
    larger than stated: differences of evidence then count less.
    """
    as_stated = _log_odds_as_stated(row, policy)
    if not row.has_errors:
        return as_stated
    none = policy.prior_of_none
    larger = row.gain_of_larger_error(policy.largest_factor) + np.log(none)
    return float(as_stated + np.logaddexp(np.log1p(-none), larger))


def _log_odds_as_stated(row: Row, policy: Policy) -> float:
    """The same, the error being as stated."""
    log_prior = log_prior_of_count(len(row.kinds), policy) + row.log_prior
    return row.log_evidence + row.gain_with_outliers + log_prior


class Weighed:
    """Rows with their odds; each is told by its number in the table."""

    def __init__(self, table: TableOfFits, policy: Policy = AS_STATED) -> None:
        self.table, self.policy, self.rows = table, policy, table.rows
        self.odds = [log_odds(row, policy) for row in self.rows]

    @cached_property
    def ranked(self) -> list[int]:
        """All rows in descending order of odds; of equal odds by kinds, in any order of rows."""
        return sorted(range(len(self.rows)), key=lambda n: (-self.odds[n], self.rows[n].kinds))

    @cached_property
    def best(self) -> int:
        """Row of the largest odds, less effects without strong evidence."""
        best = self.ranked[0]
        for other in self.ranked[1:]:
            has_fewer = len(self.rows[other].kinds) < len(self.rows[best].kinds)
            if has_fewer and self.odds[other] > self.odds[best] - np.log(self.policy.strong):
                best = other
        return best

    @cached_property
    def distinct(self) -> list[int]:
        """The best variant of each collection of kinds, in descending order of odds."""
        return self._best_by(lambda row: row.kinds)

    def _best_by(self, key: Callable[[Row], Hashable]) -> list[int]:
        """The best row of each value of a key, in descending order of odds."""
        best: dict[Hashable, int] = {}
        for number in self.ranked:
            best.setdefault(key(self.rows[number]), number)
        return list(best.values())

    def of(self, kinds: tuple[str, ...]) -> int:
        """The best variant with these kinds of effects."""
        return next(number for number in self.distinct if self.rows[number].kinds == kinds)

    def steps_to(self, last: int) -> list[int]:
        """Rows from none to one, an effect more each time, each of the largest odds.

        Only fitted hypotheses are steps; where none is left, the last step adds all other kinds.
        """
        kinds = Counter(self.rows[last].kinds)
        steps = [self.of(())] if kinds else []
        for count in range(1, kinds.total()):
            before = Counter(self.rows[steps[-1]].kinds)
            between = (
                number
                for number in self.distinct
                if len(self.rows[number].kinds) == count
                and before <= Counter(self.rows[number].kinds) <= kinds
            )
            step = next(between, None)
            if step is None:
                break
            steps.append(step)
        return [*steps, last]

    def probabilities(
        self, claimed: Sequence[str] = (), vetoed: Sequence[Sequence[str]] = ()
    ) -> dict[str, float]:
        """Posterior probability of each kind, of nothing missing and of none of these.

        Of a kind that some hypothesis has twice, that of at least two is named `point_mass_2`. Of
        collections of kinds that are vetoed, which hold these that are claimed, no others count:
        without any, they are none of these.
        """
        policy = self.policy
        log_odds = np.array([_log_odds_as_stated(row, policy) for row in self.rows])
        stated = log_odds + np.log1p(-policy.prior_of_none)
        gains = np.array([row.gain_of_none(policy.largest_factor) for row in self.rows])
        larger = log_odds + gains + np.log(policy.prior_of_none)
        total = logsumexp(np.concatenate([stated, larger]))
        shares = list(zip(np.exp(stated - total), [row.kinds for row in self.rows], strict=True))
        counted = [(share, claimed if of in vetoed else of) for share, of in shares]
        kinds = {
            numbered_kind(kind, count): float(
                sum(share for share, of in counted if of.count(kind) >= count)
            )
            for kind, count in self._counted_kinds()
        }
        nothing = sum(share for share, of in shares if not of)
        none = np.exp(logsumexp(larger) - total)
        none += 0.0 if claimed else sum(share for share, of in shares if of in vetoed)
        return kinds | {NOTHING: float(nothing), NONE: float(none)}

    def _counted_kinds(self) -> list[tuple[str, int]]:
        """Every kind once, then those that a row has more than once, with each number."""
        most = Counter(self.table.kinds)
        for row in self.rows:
            most |= Counter(row.kinds)
        several = [(kind, n) for kind in most for n in range(2, most[kind] + 1)]
        return [*((kind, 1) for kind in most), *several]

    def confounded(self) -> list[tuple[str, str]]:
        """Pairs of kinds, or variants of one, that can replace each other in the best hypothesis.

        Their odds differ by less than strong evidence; or, where both pass the test of chi2, so
        that the misfit excludes neither, by less than twice that.
        """
        return [*dict.fromkeys(pair for pair, _ in self._replacing())]

    def confounded_elsewhere(self) -> list[tuple[str, str]]:
        """Those of them that do not act at one place: a spring and a short bed under it do."""
        best = self.rows[self.best]
        pairs = (
            pair
            for pair, row in self._replacing()
            if not _at_one_place(best.place_of(pair[0]), row.place_of(pair[1]), self.policy)
        )
        return [*dict.fromkeys(pairs)]

    def _replacing(self) -> Iterator[tuple[tuple[str, str], Row]]:
        """Pairs of what replaces one another, and the row with the second."""
        best = self.rows[self.best]
        for number in self._best_by(lambda row: (row.kinds, row.variants)):
            other = self.rows[number]
            by_variant = other.kinds == best.kinds
            replaced, replacing = (
                swapped(best.variants, other.variants)
                if by_variant
                else swapped(best.kinds, other.kinds)
            )
            if len(replaced) == len(replacing) == 1 and self.is_close(number):
                yield (replaced[0], replacing[0]), other

    def is_close(self, number: int) -> bool:
        """Whether the odds of a row are not far below those of the best."""
        policy, best, other = self.policy, self.rows[self.best], self.rows[number]
        both_pass = best.passes(policy) and other.passes(policy)
        close = np.log(policy.strong_where_passing if both_pass else policy.strong)
        return bool(self.odds[self.best] - self.odds[number] < close)


def _at_one_place(one: Box | None, other: Box | None, policy: Policy) -> bool:
    """Whether all of two places is within the size of one.

    They need not overlap: of two laws each has its best place, and a body is held at its foot.
    """
    if one is None or other is None:
        return False
    low, high = np.array([one, other]).swapaxes(0, 1)
    return bool(np.all(high.max(axis=0) - low.min(axis=0) <= policy.one_place))


def swapped(kinds: Sequence[str], others: Sequence[str]) -> tuple[list[str], list[str]]:
    """Kinds that are not among others, and those that only others are."""
    mine, theirs = Counter(kinds), Counter(others)
    return [*(mine - theirs).elements()], [*(theirs - mine).elements()]


def numbered_kind(kind: str, count: int) -> str:
    """Name of a kind of which there are at least so many: point_mass, point_mass_2 and so on."""
    return kind if count == 1 else f"{kind}_{count}"
