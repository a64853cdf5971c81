"""Hypotheses that the next measurement should distinguish."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...inference.alternative_explanation import Alternative
from ...inference.chi2 import LEVEL
from ...inference.engines.about_mode import SampledPosterior
from ._estimates import laplace
from ._hypotheses import Hypothesis
from ._posterior_odds import STRONG, Comparison, p_value
from ._weighed import NOTHING


def alternatives(
    comparison: Comparison,
    hypotheses: Sequence[Hypothesis],
    sampled: Mapping[int, SampledPosterior],
) -> tuple[Alternative, ...]:
    """Hypotheses that the next measurement should distinguish, in descending order of odds.

    These are hypotheses whose odds differ from the best by less than strong evidence, and those of
    as many effects that pass the test of chi2. Larger differences of odds are limited to strong
    evidence, so that no hypothesis is practically excluded.
    """
    best = max(hypotheses, key=comparison.log_odds)
    greatest = comparison.log_odds(best)

    def survives(hypothesis: Hypothesis) -> bool:
        same_size = len(hypothesis.effects) == len(best.effects)
        explains = same_size and p_value(hypothesis) >= LEVEL
        return bool(explains or comparison.log_odds(hypothesis) > greatest - STRONG)

    return tuple(
        Alternative(
            name=" + ".join(hypothesis.kinds) or NOTHING,
            probability=float(np.exp(max(comparison.log_odds(hypothesis) - greatest, -STRONG))),
            experiment=hypothesis.problem.at_fixed_sizes,
            draws=hypothesis.problem.coordinates.named(
                sampled[id(hypothesis)].points if id(hypothesis) in sampled else laplace(hypothesis)
            ),
        )
        for hypothesis in hypotheses
        if survives(hypothesis)
    )
