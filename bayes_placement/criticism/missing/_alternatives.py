"""_alternatives: in, fitted hypotheses; out, those that survive, for what measures next.

Not known here: how a fit was found, where to measure.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from ...inference.alternative_explanation import Alternative
from ...inference.engines.about_mode import SampledPosterior
from ._estimates import laplace
from ._hypotheses import Hypothesis
from ._odds import LEVEL, NOTHING, STRONG, Pool, p_value


def alternatives(
    pool: Pool, chosen: Sequence[Hypothesis], sampled: Mapping[int, SampledPosterior]
) -> tuple[Alternative, ...]:
    """Hypotheses that a next measurement should tell apart, by falling odds.

    Those whose odds are within strong evidence of the best, and all of as many effects that
    explain the data down to the noise: against these speaks no misfit. What is more than strong
    evidence counts as strong evidence, so that none is written off beforehand.
    """
    best = max(chosen, key=pool.log_odds)
    most = pool.log_odds(best)

    def survives(one: Hypothesis) -> bool:
        alike = len(one.effects) == len(best.effects) and p_value(one) >= LEVEL
        return bool(alike or pool.log_odds(one) > most - STRONG)

    surviving = [one for one in chosen if survives(one)]
    return tuple(
        Alternative(
            name=" + ".join(one.kinds) or NOTHING,
            probability=float(np.exp(max(pool.log_odds(one) - most, -STRONG))),
            experiment=one.problem.experiment,
            draws=one.problem.coordinates.named(
                sampled[id(one)].points if id(one) in sampled else laplace(one)
            ),
        )
        for one in surviving
    )
