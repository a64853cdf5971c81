"""Hypotheses that a next measurement should tell apart."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...inference.alternative_explanation import Alternative
from ...inference.engines.about_mode import SampledPosterior
from ._estimates import laplace
from ._hypotheses import Hypothesis
from ._posterior_odds import LEVEL, NOTHING, STRONG, Comparison, p_value


def alternatives(
    comparison: Comparison,
    hypotheses: Sequence[Hypothesis],
    sampled: Mapping[int, SampledPosterior],
) -> tuple[Alternative, ...]:
    """Hypotheses that a next measurement should tell apart, by falling odds.

    Those whose odds are within strong evidence of the best, and all of as many effects that
    explain the data down to the noise: against these speaks no misfit. What is more than strong
    evidence counts as strong evidence, so that none is excluded beforehand.
    """
    best = max(hypotheses, key=comparison.log_odds)
    greatest = comparison.log_odds(best)

    def survives(hypothesis: Hypothesis) -> bool:
        as_many = len(hypothesis.effects) == len(best.effects)
        explains = as_many and p_value(hypothesis) >= LEVEL
        return bool(explains or comparison.log_odds(hypothesis) > greatest - STRONG)

    return tuple(
        Alternative(
            name=" + ".join(hypothesis.kinds) or NOTHING,
            probability=float(np.exp(max(comparison.log_odds(hypothesis) - greatest, -STRONG))),
            experiment=hypothesis.problem.experiment,
            draws=hypothesis.problem.coordinates.named(
                sampled[id(hypothesis)].points if id(hypothesis) in sampled else laplace(hypothesis)
            ),
        )
        for hypothesis in hypotheses
        if survives(hypothesis)
    )
