"""Posterior odds of hypotheses: the probability of each effect, of nothing and of none of these."""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2

from ._hypotheses import Hypothesis, ScannedCandidate

NOTHING, NONE = "nothing_missing", "none_of_these"

PRIOR_OF_ONE_MORE = 0.5
"""Prior probability that one more effect is missing, given those that are."""

PRIOR_OF_NONE = 0.05
"""Prior probability that the error is larger than stated, by a cause that no candidate has."""

LARGEST_FACTOR = 1e3
"""Greatest factor on the stated deviation, log-uniform from 1."""

STRONG = np.log(20.0)
"""Log Bayes factor of strong evidence (Kass and Raftery, doi:10.1080/01621459.1995.10476572)."""

LEVEL = 0.01
"""Probability that a right model fails its check."""


class Comparison(NamedTuple):
    """Hypotheses that are compared, and the candidates that they were chosen among.

    Parameters
    ----------
    hypotheses
        Fitted hypotheses, one of them without effects.
    variants
        Number of variants of each kind.
    candidates
        Every candidate alone, scanned.
    """

    hypotheses: list[Hypothesis]
    variants: dict[str, int]
    candidates: Sequence[ScannedCandidate] = ()

    def with_hypotheses(self, hypotheses: Sequence[Hypothesis]) -> "Comparison":
        """Return the comparison with further hypotheses."""
        return self._replace(hypotheses=[*self.hypotheses, *hypotheses])

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
        best: dict[tuple[str, ...], Hypothesis] = {}
        for hypothesis in sorted(self.hypotheses, key=self.log_odds, reverse=True):
            best.setdefault(hypothesis.kinds, hypothesis)
        return list(best.values())

    def of(self, kinds: tuple[str, ...]) -> Hypothesis:
        """The best variant with these kinds of effects."""
        return next(hypothesis for hypothesis in self.distinct() if hypothesis.kinds == kinds)

    def probabilities(self) -> dict[str, float]:
        """Posterior probability of each kind, of nothing missing and of none of these."""
        log_odds = np.array([self.log_odds(hypothesis) for hypothesis in self.hypotheses])
        stated = log_odds + np.log1p(-PRIOR_OF_NONE)
        gains = np.array([_gain_of_larger_error(hypothesis) for hypothesis in self.hypotheses])
        larger = log_odds + gains + np.log(PRIOR_OF_NONE)
        total = logsumexp(np.concatenate([stated, larger]))
        shares = list(zip(np.exp(stated - total), self.hypotheses, strict=True))
        kinds = {
            kind: float(sum(share for share, hypothesis in shares if kind in hypothesis.kinds))
            for kind in self.variants
        }
        nothing = sum(share for share, hypothesis in shares if not hypothesis.effects)
        return kinds | {NOTHING: float(nothing), NONE: float(np.exp(logsumexp(larger) - total))}

    def confounded(self) -> list[tuple[str, str]]:
        """Pairs of kinds of which either explains the data, one in the place of the other.

        Their odds differ by less than strong evidence, or both leave no more than the noise does:
        then no misfit speaks against either, and the evidence only prefers the simpler one.
        """
        best, pairs = self.best(), []
        for other in self.distinct():
            of_best = set(best.kinds) - set(other.kinds)
            of_other = set(other.kinds) - set(best.kinds)
            if len(of_best) == len(of_other) == 1 and len(best.effects) == len(other.effects):
                near = self.log_odds(best) - self.log_odds(other) < STRONG
                if near or min(p_value(best), p_value(other)) >= LEVEL:
                    pairs.append((next(iter(of_best)), next(iter(of_other))))
        return pairs


def p_value(hypothesis: Hypothesis) -> float:
    """Probability that a right model leaves at least as large a sum of squares.

    NaN where the data determine as many unknowns as there are data.
    """
    degrees_of_freedom = hypothesis.problem.count - hypothesis.fit.determined
    if degrees_of_freedom <= 0:
        return float("nan")
    return float(chi2.sf(hypothesis.fit.squares, degrees_of_freedom))


def _gain_of_larger_error(hypothesis: Hypothesis) -> float:
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


def steps_to(comparison: Comparison, best: Hypothesis) -> list[tuple[str, ...]]:
    """Sets of kinds from nothing to the best hypothesis, each with the greatest odds of its size.

    Only hypotheses that were fitted are steps; where none leads on, the rest comes at once.
    """
    steps: list[tuple[str, ...]] = [()]
    for count in range(1, len(best.kinds)):
        between = [
            hypothesis
            for hypothesis in comparison.distinct()
            if len(hypothesis.kinds) == count
            and Counter(steps[-1]) <= Counter(hypothesis.kinds) <= Counter(best.kinds)
        ]
        if not between:
            break
        steps.append(max(between, key=comparison.log_odds).kinds)
    return [*steps, best.kinds] if best.kinds else steps
