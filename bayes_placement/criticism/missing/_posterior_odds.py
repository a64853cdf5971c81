"""Posterior odds of hypotheses on missing effects, by the rows of their fits."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...effects.effect import Effect
from ...inference.engines.about_mode import SampledPosterior
from ..reach.reach import Reach
from ._hypotheses import Hypothesis
from ._rows import places_of, row_in_full, row_of
from ._scanned_candidates import ScannedCandidate
from ._weighed import Weighed, log_odds, log_prior_of_count
from .table import AS_STATED, Policy, Row, TableOfFits

STRONG = np.log(AS_STATED.strong)
"""Log Bayes factor of strong evidence."""


ONE_FIT = 0.01
"""Squares by which two ends of descents at one fit differ, at most."""


class Comparison(NamedTuple):
    """Fitted hypotheses, and the candidates that they were chosen from.

    One of the hypotheses is without effects. `variants` numbers those of each kind; `candidates`
    are scans of each alone. `networks` are log prior probabilities of those that are in no list,
    within their kind of port. `reach` is what laws at each place could remove, None where that was
    not looked for. `swaps` are all swapped pairs; candidates are those that leave least.
    """

    hypotheses: list[Hypothesis]
    variants: dict[str, int]
    candidates: Sequence[ScannedCandidate] = ()
    networks: Mapping[str, float] = MappingProxyType({})
    reach: Reach | None = None
    swaps: Sequence[Effect] = ()

    def with_hypotheses(
        self, hypotheses: Sequence[Hypothesis], networks: Mapping[str, float] = MappingProxyType({})
    ) -> "Comparison":
        """Return the comparison with further hypotheses, and the priors of their networks.

        With a network that was found beside several others, and ends at one fit, there is one.
        """
        known, networks = [*self.hypotheses], {**self.networks, **networks}
        for hypothesis in hypotheses:
            is_known = any(_end_at_one_fit(hypothesis, other) for other in known)
            if not (is_known and networks.keys() & {*hypothesis.kinds}):
                known.append(hypothesis)
        return self._replace(hypotheses=known, networks=networks)

    def joined(self, others: "Comparison") -> "Comparison":
        """Return the comparison with those of other candidates on the same model."""
        return self._replace(
            hypotheses=[*self.hypotheses, *others.hypotheses[1:]],
            variants=self.variants | others.variants,
            candidates=[*self.candidates, *others.candidates],
            swaps=[*self.swaps, *others.swaps],
        )

    def log_odds(self, hypothesis: Hypothesis) -> float:
        """Log evidence plus log prior probability of its effects; see `_weighed.log_odds`."""
        return log_odds(self._row(hypothesis), AS_STATED)

    def log_prior(self, hypothesis: Hypothesis) -> float:
        """Log prior probability, halved by each further effect; most kinds are equally probable."""
        count = len(hypothesis.effects)
        return log_prior_of_count(count, AS_STATED) + self._log_prior_of_kinds(hypothesis)

    def _log_prior_of_kinds(self, hypothesis: Hypothesis) -> float:
        """Log prior probability among all hypotheses of as many effects.

        All collections of as many kinds are equally probable, those with a kind more than once
        among them. What every structure has, if only a little of it, shares with no other kind.
        """
        special = [effect for effect in hypothesis.effects if not effect.in_every_structure]
        kinds = len(special) * np.log(max(1, len(self.variants)))
        variants = sum(np.log(max(1, self.variants.get(kind, 1))) for kind in hypothesis.kinds)
        networks = sum(self.networks.get(kind, 0.0) for kind in hypothesis.kinds)
        return float(networks - kinds - variants)

    def _row(self, hypothesis: Hypothesis) -> Row:
        return row_of(hypothesis, self._log_prior_of_kinds(hypothesis))

    @property
    def table(self) -> TableOfFits:
        """Rows of all hypotheses, of what their fits alone say."""
        return TableOfFits([*map(self._row, self.hypotheses)], (*self.variants, *self.networks))

    def table_in_full(self, policy: Policy, sampled: Mapping[int, SampledPosterior]) -> TableOfFits:
        """Rows of all hypotheses, in full on the way to the best one: what may be claimed.

        Of the best one and of those close to it with places.
        """
        table = self.table
        weighed, rows = Weighed(table, policy), list(table.rows)
        for number, hypothesis in enumerate(self.hypotheses):
            if weighed.is_close(number):
                rows[number] = rows[number]._replace(places=tuple(places_of(hypothesis)))
        for number in weighed.steps_to(weighed.best):
            hypothesis = self.hypotheses[number]
            rows[number] = row_in_full(rows[number], hypothesis, sampled.get(id(hypothesis)))
        return table._replace(rows=rows)

    @property
    def weighed(self) -> Weighed:
        """Rows of all hypotheses with their odds."""
        return Weighed(self.table)

    def best(self) -> Hypothesis:
        """Hypothesis of the largest odds, less effects without strong evidence."""
        return self.hypotheses[self.weighed.best]

    def distinct(self) -> list[Hypothesis]:
        """The best variant of each collection of kinds, in descending order of odds."""
        return [self.hypotheses[number] for number in self.weighed.distinct]

    def of(self, kinds: tuple[str, ...]) -> Hypothesis:
        """The best variant with these kinds of effects."""
        return self.hypotheses[self.weighed.of(kinds)]


def _end_at_one_fit(first: Hypothesis, second: Hypothesis) -> bool:
    """Whether two are of the same kinds, and leave the same; a deviation away chi2 grows by 1."""
    return first.kinds == second.kinds and abs(first.fit.squares - second.fit.squares) < ONE_FIT


def passes(hypothesis: Hypothesis, level: float) -> bool:
    """Whether a hypothesis passes its check; where the noise is unknown, no check is possible."""
    return hypothesis.is_noise_known and row_of(hypothesis).passes(Policy(level=level))


def explains(hypothesis: Hypothesis, level: float) -> bool:
    """Whether a hypothesis leaves nothing but noise, so that no more effects are looked for."""
    return row_of(hypothesis).explains(Policy(level=level))


def p_value(hypothesis: Hypothesis) -> float:
    """P-value of the check of a hypothesis, see `Row.p_value`."""
    return row_of(hypothesis).p_value


def wants_more_effects(comparison: Comparison, depth: int, level: float) -> bool:
    """Whether the best hypothesis has so many effects and still does not explain the data."""
    best = comparison.best()
    return len(best.effects) >= depth and not explains(best, level)


def greatest_odds_expected(comparison: Comparison, depth: int, further_effects: int) -> float:
    """Odds that hypotheses of so many effects and some more are not expected to exceed.

    Of effects that move different data, each lowers the misfit less than the one before. A rule of
    the search, no bound: two effects can hide each other.
    """
    before, best = (_best_of(comparison, count) for count in (depth - 1, depth))
    odds = comparison.log_odds(best)
    gain = max(0.0, odds - comparison.log_odds(before))
    if best.is_noise_known:
        return odds + further_effects * gain
    return odds + _gain_of_less_noise(gain, further_effects, best.problem.count)


def _gain_of_less_noise(gain: float, further_effects: int, count: int) -> float:
    """Log evidence gained where the mean square falls with each effect as much as it just did.

    The noise takes up the misfit, so that the log evidence falls with the log of the mean square.
    """
    fallen = np.expm1(min(2 * gain / count, 1.0))  # by more than all that is left, in any case
    left = 1.0 - further_effects * float(fallen)
    return np.inf if left <= 0 else -0.5 * count * float(np.log(left))


def may_explain(comparison: Comparison, depth: int, further_effects: int, level: float) -> bool:
    """Whether some more effects than so many are expected to leave nothing but noise.

    Each may lower the sum of squares by twice as much as the one before, so that no effect is given
    up that others hide a little. Where the model is wrong as a whole, the next lowers it by a small
    part of what is left. No check says so of unknown noise, nor of the first effect.
    """
    before, best = (row_of(_best_of(comparison, count)) for count in (depth - 1, depth))
    if depth < 2 or not best.is_noise_known:
        return True
    least = best.squares - 2 * further_effects * max(0.0, before.squares - best.squares)
    return best._replace(squares=max(0.0, least)).explains(Policy(level=level))


def _best_of(comparison: Comparison, count: int) -> Hypothesis:
    """The hypothesis of so many effects of the largest odds."""
    of_count = (each for each in comparison.hypotheses if len(each.effects) == count)
    return max(of_count, key=comparison.log_odds)
