"""Posterior odds of hypotheses on missing effects, and probabilities of each kind of effect."""

from collections import Counter
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2

from ...inference.chi2 import LEVEL
from ..reach.reach import Reach
from ._hypotheses import Hypothesis
from ._scanned_candidates import ScannedCandidate
from ._unknown_noise import (
    gain_of_smooth_misfit,
    gain_with_outliers,
    p_value_of_outliers,
    scatter,
)

NOTHING, NONE = "nothing_missing", "none_of_these"

PRIOR_OF_FURTHER_EFFECT = 0.5
"""Prior probability that a further effect is missing."""

PRIOR_OF_NONE = 0.05
"""Prior probability that the error is larger than stated, for a reason that no candidate has."""

LARGEST_FACTOR = 1e3
"""Greatest factor on the stated deviation, log-uniform from 1."""

STRONG = np.log(20.0)
"""Log Bayes factor of strong evidence (Kass and Raftery, doi:10.1080/01621459.1995.10476572)."""


class Comparison(NamedTuple):
    """Fitted hypotheses, and the candidates that they were chosen from.

    Parameters
    ----------
    hypotheses
        Fitted hypotheses, one of them without effects.
    variants
        Number of variants of each kind.
    candidates
        Scan of each candidate alone.
    networks
        Log prior probability of each network that is in no list, within its kind of port.
    reach
        What laws at each place could remove; None where that was not looked for.
    """

    hypotheses: list[Hypothesis]
    variants: dict[str, int]
    candidates: Sequence[ScannedCandidate] = ()
    networks: Mapping[str, float] = MappingProxyType({})
    reach: Reach | None = None

    def with_hypotheses(
        self,
        hypotheses: Sequence[Hypothesis],
        networks: Mapping[str, float] = MappingProxyType({}),
    ) -> "Comparison":
        """Return the comparison with further hypotheses, and the priors of their networks."""
        return self._replace(
            hypotheses=[*self.hypotheses, *hypotheses], networks={**self.networks, **networks}
        )

    def joined(self, others: "Comparison") -> "Comparison":
        """Return the comparison with those of other candidates on the same model."""
        return self._replace(
            hypotheses=[*self.hypotheses, *others.hypotheses[1:]],
            variants=self.variants | others.variants,
            candidates=[*self.candidates, *others.candidates],
        )

    def log_odds(self, hypothesis: Hypothesis) -> float:
        """Log evidence plus log prior probability of its effects.

        A model error may not have the form of the true one. Beside it, the error may therefore be
        larger than stated: differences of evidence then count less.
        """
        log_odds = self._log_odds_as_stated(hypothesis)
        if not hypothesis.has_errors:
            return log_odds
        larger = _gain_of_larger_error(hypothesis) + np.log(PRIOR_OF_NONE)
        return float(log_odds + np.logaddexp(np.log1p(-PRIOR_OF_NONE), larger))

    def _log_odds_as_stated(self, hypothesis: Hypothesis) -> float:
        """The same, the error being as stated."""
        log_evidence = hypothesis.log_evidence + gain_with_outliers(hypothesis)
        return log_evidence + self.log_prior(hypothesis)

    def log_prior(self, hypothesis: Hypothesis) -> float:
        """Log prior probability, halved by each further effect; all kinds are equally probable.

        So are all collections of as many kinds, those with a kind more than once among them.
        """
        count = len(hypothesis.effects)
        steps = (count + 1) * np.log(PRIOR_OF_FURTHER_EFFECT)
        kinds = count * np.log(max(1, len(self.variants)))
        variants = sum(np.log(max(1, self.variants.get(kind, 1))) for kind in hypothesis.kinds)
        networks = sum(self.networks.get(kind, 0.0) for kind in hypothesis.kinds)
        return float(steps - kinds - variants + networks)

    def best(self) -> Hypothesis:
        """Hypothesis of the largest odds, less effects without strong evidence."""
        ranked = sorted(self.hypotheses, key=self.log_odds, reverse=True)
        best = ranked[0]
        for hypothesis in ranked[1:]:
            has_fewer = len(hypothesis.effects) < len(best.effects)
            if has_fewer and self.log_odds(hypothesis) > self.log_odds(best) - STRONG:
                best = hypothesis
        return best

    def distinct(self) -> list[Hypothesis]:
        """The best variant of each collection of kinds, in descending order of odds."""
        best: dict[tuple[str, ...], Hypothesis] = {}
        for hypothesis in sorted(self.hypotheses, key=self.log_odds, reverse=True):
            best.setdefault(hypothesis.kinds, hypothesis)
        return list(best.values())

    def of(self, kinds: tuple[str, ...]) -> Hypothesis:
        """The best variant with these kinds of effects."""
        return next(hypothesis for hypothesis in self.distinct() if hypothesis.kinds == kinds)

    def probabilities(self) -> dict[str, float]:
        """Posterior probability of each kind, of nothing missing and of none of these.

        Of a kind that some hypothesis has twice, that of at least two is named `point_mass_2`.
        """
        log_odds = np.array([self._log_odds_as_stated(h) for h in self.hypotheses])
        stated = log_odds + np.log1p(-PRIOR_OF_NONE)
        gains = np.array([_gain_of_none(hypothesis) for hypothesis in self.hypotheses])
        larger = log_odds + gains + np.log(PRIOR_OF_NONE)
        total = logsumexp(np.concatenate([stated, larger]))
        shares = list(zip(np.exp(stated - total), self.hypotheses, strict=True))
        kinds = {
            numbered_kind(kind, count): float(
                sum(share for share, hypothesis in shares if hypothesis.kinds.count(kind) >= count)
            )
            for kind, count in self._counted_kinds()
        }
        nothing = sum(share for share, hypothesis in shares if not hypothesis.effects)
        return kinds | {NOTHING: float(nothing), NONE: float(np.exp(logsumexp(larger) - total))}

    def _counted_kinds(self) -> list[tuple[str, int]]:
        """Every kind once, then those that a hypothesis has more than once, with each number."""
        counts = {kind: 1 for kind in (*self.variants, *self.networks)}
        most = Counter(counts)
        for hypothesis in self.hypotheses:
            most |= Counter(hypothesis.kinds)
        several = [(kind, n) for kind in counts for n in range(2, most[kind] + 1)]
        return [*counts.items(), *several]

    def confounded(self) -> list[tuple[str, str]]:
        """Pairs of kinds that can replace each other in the best hypothesis.

        Their odds differ by less than strong evidence; or, where both pass the test of chi2, so
        that the misfit excludes neither, by less than twice that.
        """
        best, pairs = self.best(), []
        for hypothesis in self.distinct():
            replaced = Counter(best.kinds) - Counter(hypothesis.kinds)
            replacing = Counter(hypothesis.kinds) - Counter(best.kinds)
            close = (2 if passes(best, LEVEL) and passes(hypothesis, LEVEL) else 1) * STRONG
            similar_odds = self.log_odds(best) - self.log_odds(hypothesis) < close
            if replaced.total() == replacing.total() == 1 and similar_odds:
                pairs.append((next(iter(replaced)), next(iter(replacing))))
        return pairs


def numbered_kind(kind: str, count: int) -> str:
    """Name of a kind of which there are at least so many: point_mass, point_mass_2 and so on."""
    return kind if count == 1 else f"{kind}_{count}"


def passes(hypothesis: Hypothesis, level: float) -> bool:
    """Whether a hypothesis passes its check; where the noise is unknown, no check is possible."""
    return hypothesis.is_noise_known and not p_value(hypothesis) < level


def explains(hypothesis: Hypothesis, level: float) -> bool:
    """Whether a hypothesis leaves nothing but noise, so that no more effects are looked for.

    It passes its check; or, where the noise is unknown, its residuals are no larger than the
    scatter of neighbouring lines, and no more of them are outliers than assumed. That alone does
    not say that a model is right: at lines far from each other any misfit scatters.
    """
    if hypothesis.is_noise_known:
        return passes(hypothesis, level)
    return p_value(hypothesis) >= level and p_value_of_outliers(hypothesis) >= level


def wants_more_effects(comparison: Comparison, depth: int, level: float) -> bool:
    """Whether the best hypothesis has so many effects and still does not explain the data."""
    best = comparison.best()
    return len(best.effects) >= depth and not explains(best, level)


def greatest_odds_expected(comparison: Comparison, depth: int, further_effects: int) -> float:
    """Odds that hypotheses of so many effects and some more are not expected to exceed.

    Of effects that move different data, each gains less than the one before. A rule of the search,
    no bound: two effects can hide each other.
    """
    odds = [
        max(comparison.log_odds(h) for h in comparison.hypotheses if len(h.effects) == count)
        for count in (depth - 1, depth)
    ]
    return float(odds[1] + further_effects * max(0.0, odds[1] - odds[0]))


def p_value(hypothesis: Hypothesis) -> float:
    """Probability that a correct model has at least as large a sum of squares.

    NaN where the data determine as many unknowns as there are data. Where the noise is not known,
    that its residuals exceed the scatter of neighbouring lines as much.
    """
    if not hypothesis.is_noise_known:
        return scatter(hypothesis)[1]
    degrees_of_freedom = hypothesis.problem.count - hypothesis.fit.determined
    if degrees_of_freedom <= 0:
        return float("nan")
    return float(chi2.sf(hypothesis.fit.squares, degrees_of_freedom))


def _gain_of_larger_error(hypothesis: Hypothesis) -> float:
    """Gain of log evidence where the error may be larger by an unknown factor s.

    Laplace's method in log s about s^2 = squares per degree of freedom; where this is below 1,
    about s = 1 with the lower half of the Gaussian cut off. Posterior deviations of parameters grow
    by s. An error that is not stated is none that could be larger.
    """
    if not hypothesis.is_noise_known:
        return -np.inf
    squares = hypothesis.fit.squares
    free = max(hypothesis.problem.count - hypothesis.fit.determined, 1.0)
    factor = max(squares / free, 1.0)
    gain = 0.5 * squares * (1 - 1 / factor) - 0.5 * free * np.log(factor)
    width = np.sqrt(np.pi / free) * (1.0 if factor > 1 else 0.5)
    return float(gain + np.log(width / np.log(LARGEST_FACTOR)))


def _gain_of_none(hypothesis: Hypothesis) -> float:
    """Gain of log evidence where something is missing that no candidate is.

    A stated noise may be too small by a factor. One that is not stated takes up the misfit by
    itself, which then is larger than the scatter of neighbouring lines.
    """
    if hypothesis.is_noise_known:
        return _gain_of_larger_error(hypothesis)
    return gain_of_smooth_misfit(hypothesis, LARGEST_FACTOR)


def steps_to(comparison: Comparison, best: Hypothesis) -> list[tuple[str, ...]]:
    """Kinds from none to those of the best hypothesis, each time with the largest odds.

    Only fitted hypotheses are steps; where none is left, the last step adds all remaining kinds.
    """
    steps: list[tuple[str, ...]] = [()]
    for count in range(1, len(best.kinds)):
        intermediate = [
            hypothesis
            for hypothesis in comparison.distinct()
            if len(hypothesis.kinds) == count
            and Counter(steps[-1]) <= Counter(hypothesis.kinds) <= Counter(best.kinds)
        ]
        if not intermediate:
            break
        steps.append(max(intermediate, key=comparison.log_odds).kinds)
    return [*steps, best.kinds] if best.kinds else steps
