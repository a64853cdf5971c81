"""_odds: in, fitted hypotheses; out, the probability of each effect, of nothing and of none.

Not known here: how a fit was found, experiments.
"""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2

from ._hypotheses import Hypothesis, Scanned

NOTHING, NONE = "nothing_missing", "none_of_these"

PRIOR_OF_ONE_MORE = 0.5
"""Prior probability that one more effect is missing, given those found."""

PRIOR_OF_NONE = 0.05
"""Prior probability that the error is larger than stated, by a cause that no candidate has."""

LARGEST_FACTOR = 1e3
"""Greatest factor on the stated deviation, log-uniform from 1."""

STRONG = np.log(20.0)
"""Log Bayes factor of strong evidence (Kass and Raftery, doi:10.1080/01621459.1995.10476572)."""

LEVEL = 0.01
"""Probability that a right model fails its check."""


class Pool(NamedTuple):
    """Hypotheses, and the candidates that they were chosen among.

    Parameters
    ----------
    hypotheses
        Fitted hypotheses, one of them without effects.
    variants
        Number of variants of each kind.
    scanned
        Every candidate alone, scanned.
    """

    hypotheses: list[Hypothesis]
    variants: dict[str, int]
    scanned: Sequence[Scanned] = ()

    def log_odds(self, hypothesis: Hypothesis) -> float:
        """Log evidence with the log prior probability of its effects."""
        return hypothesis.fit.log_evidence + self.log_prior(hypothesis)

    def log_prior(self, hypothesis: Hypothesis) -> float:
        """Log prior probability: each number of effects half of the one before, kinds alike."""
        count = len(hypothesis.effects)
        steps = (count + 1) * np.log(PRIOR_OF_ONE_MORE)
        kinds = count * np.log(max(1, len(self.variants)))
        variants = sum(np.log(max(1, self.variants.get(kind, 1))) for kind in hypothesis.kinds)
        return float(steps - kinds - variants)

    def best(self) -> Hypothesis:
        """Hypothesis of the greatest odds; each of its effects has strong evidence.

        An effect for which the odds speak, but not strongly, is not claimed.
        """
        ranked = sorted(self.hypotheses, key=self.log_odds, reverse=True)
        best = ranked[0]
        for other in ranked[1:]:
            fewer = len(other.effects) < len(best.effects)
            if fewer and self.log_odds(other) > self.log_odds(best) - STRONG:
                best = other
        return best

    def distinct(self) -> list[Hypothesis]:
        """The best variant of each set of kinds, by falling odds."""
        ranked = sorted(self.hypotheses, key=self.log_odds, reverse=True)
        found: dict[tuple[str, ...], Hypothesis] = {}
        for one in ranked:
            found.setdefault(one.kinds, one)
        return list(found.values())

    def of(self, kinds: tuple[str, ...]) -> Hypothesis:
        """The best variant with these kinds of effects."""
        return next(one for one in self.distinct() if one.kinds == kinds)

    def probabilities(self) -> dict[str, float]:
        """Posterior probability of each kind, of nothing missing and of none of these."""
        known = np.array([self.log_odds(one) for one in self.hypotheses]) + np.log1p(-PRIOR_OF_NONE)
        larger = np.array([self.log_odds(one) + _inflated(one) for one in self.hypotheses])
        larger += np.log(PRIOR_OF_NONE)
        whole = logsumexp(np.concatenate([known, larger]))
        share = np.exp(known - whole)
        kinds = {
            kind: float(
                sum(p for p, h in zip(share, self.hypotheses, strict=True) if kind in h.kinds)
            )
            for kind in self.variants
        }
        nothing = sum(p for p, h in zip(share, self.hypotheses, strict=True) if not h.effects)
        return kinds | {NOTHING: float(nothing), NONE: float(np.exp(logsumexp(larger) - whole))}

    def confounded(self) -> list[tuple[str, str]]:
        """Pairs of kinds of which either explains the data, one in the place of the other.

        Their odds differ by less than strong evidence, or both leave no more than the noise does:
        then no misfit speaks against either, and the evidence only prefers the simpler one.
        """
        best, pairs = self.best(), []
        for other in self.distinct():
            mine, its = set(best.kinds) - set(other.kinds), set(other.kinds) - set(best.kinds)
            if len(mine) == len(its) == 1 and len(best.effects) == len(other.effects):
                near = self.log_odds(best) - self.log_odds(other) < STRONG
                if near or min(p_value(best), p_value(other)) >= LEVEL:
                    pairs.append((next(iter(mine)), next(iter(its))))
        return pairs


def p_value(hypothesis: Hypothesis) -> float:
    """Probability that a right model leaves at least as large a sum of squares.

    NaN where the data determine as many unknowns as there are data.
    """
    degrees_of_freedom = hypothesis.problem.count - hypothesis.fit.determined
    if degrees_of_freedom <= 0:
        return float("nan")
    return float(chi2.sf(hypothesis.fit.squares, degrees_of_freedom))


def _inflated(hypothesis: Hypothesis) -> float:
    """Log evidence that is gained once the error may be larger by an unknown factor s.

    Laplace's method in log s about s^2 = squares per datum, at least 1, where the half of the
    Gaussian that lies below is cut off; parameters then are less sharp by s.
    """
    count, squares = hypothesis.problem.count, hypothesis.fit.squares
    factor = max(squares / count, 1.0)
    determined = hypothesis.fit.determined
    gain = 0.5 * squares * (1 - 1 / factor) - 0.5 * (count - determined) * np.log(factor)
    width = np.sqrt(np.pi / count) * (1.0 if factor > 1 else 0.5)
    return float(gain + np.log(width / np.log(LARGEST_FACTOR)))


def ordered(pool: Pool, best: Hypothesis) -> list[tuple[str, ...]]:
    """Sets of kinds on the way from nothing to the best hypothesis, each step the best one.

    Only hypotheses that were fitted are on the way; where none leads on, the rest comes at once.
    """
    way: list[tuple[str, ...]] = [()]
    for one_more in range(1, len(best.kinds)):
        between = [
            one
            for one in pool.distinct()
            if len(one.kinds) == one_more
            and Counter(way[-1]) <= Counter(one.kinds) <= Counter(best.kinds)
        ]
        if not between:
            break
        way.append(max(between, key=pool.log_odds).kinds)
    return [*way, best.kinds] if best.kinds else way
