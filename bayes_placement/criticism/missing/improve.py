"""improve: in, an experiment and a measurement; out, the effects that it lacks, one step at a time.

Not known here: how hypotheses are searched and compared, files.
"""

import itertools
import time
from collections import Counter
from collections.abc import Callable

import pandas as pd
from threadpoolctl import threadpool_limits

from ..._types import Progress, no_progress
from ...effects.library import Library, kind_of, library
from ...experiment.experiment import Experiment, Measurements
from ._alternatives import alternatives
from ._branches import deeper, singles
from ._hypotheses import Hypothesis, alone
from ._odds import LEVEL, Pool, ordered, p_value
from ._suspicion import suspicion
from .explain import Sampled, finalists, step_of
from .ledger import Ledger, Step

MOST_EFFECTS = 3


@threadpool_limits.wrap(limits=1)  # small products: BLAS threads would only wait for each other
def improve(
    experiment: Experiment,
    measurement: Measurements,
    *,
    candidates: Library | None = None,
    level: float = LEVEL,
    most_effects: int = MOST_EFFECTS,
    progress: Progress = no_progress,
) -> Ledger:
    """Add the effects that a model lacks, until it passes its check or nothing pays any more.

    An effect is claimed only where the model without it fails its check, and where its evidence
    is strong (a Bayes factor of 20, candidates of the prior included). Several branches stay open,
    since the best single effect need not belong to the best pair, and each effect of the best
    explanation is taken away again and replaced.

    Parameters
    ----------
    experiment
        The model as given, with its priors.
    measurement
        What was measured: one measurement, or one for each force level.
    candidates
        `effects.library(experiment)` by default.
    level
        Probability that a right model fails its check of chi2.
    most_effects
        Most effects that are added.
    progress
        Called with the share of the work done.

    Raises
    ------
    ValueError
        If nothing is unknown, or data and experiment do not match.
    """
    began = time.perf_counter()
    chosen = library(experiment) if candidates is None else candidates
    null = alone(experiment, experiment.data(measurement))
    pool = singles(null, chosen.effects, _ticks(progress, len(chosen.effects), (0.02, 0.6)))
    if p_value(null) < level:
        pool = _deepened(pool, level, most_effects, progress)
        best = pool.best()
    else:
        best = null
    progress(0.9)
    draws = finalists(pool, [best])
    progress(0.97)
    steps = _steps(pool, best, draws)
    progress(1.0)
    return Ledger(
        steps=steps,
        verdict=best.kinds,
        probabilities=pool.probabilities(),
        confounded=tuple(pool.confounded()),
        unexplained=p_value(best) < level,
        seconds=time.perf_counter() - began,
        experiment=best.problem.experiment,
        compared=_compared(pool),
        suspicion=suspicion(null, pool.scanned),
        alternatives=alternatives(pool, pool.distinct(), draws),
    )


def _deepened(pool: Pool, level: float, most: int, progress: Progress) -> Pool:
    for depth in range(1, most):
        best = pool.best()
        if p_value(best) >= level or len(best.effects) < depth:
            break
        share = (0.6 + 0.3 * (depth - 1) / most, 0.6 + 0.3 * depth / most)
        pool = deeper(pool, depth, _ticks(progress, 20, share))
    return pool


def _ticks(progress: Progress, count: int, share: tuple[float, float]) -> Callable[[], None]:
    """Report one of several equal parts of a share of the work at each call."""
    done = 0

    def tick() -> None:
        nonlocal done
        done = min(done + 1, count)
        progress(share[0] + (share[1] - share[0]) * done / max(1, count))

    return tick


def _steps(pool: Pool, best: Hypothesis, draws: Sampled) -> tuple[Step, ...]:
    """The way from the model as given to the best hypothesis, one effect a step."""
    way = ordered(pool, best)
    chosen = [pool.of(kinds) for kinds in way[:-1]] + [best] if best.effects else [best]
    steps = [step_of(chosen[0], draws)]
    for before, after in itertools.pairwise(chosen):
        new = Counter(after.kinds) - Counter(before.kinds)
        added = next(one.name for one in after.effects if kind_of(one) in new)
        steps.append(step_of(after, draws, added))
    return tuple(steps)


def _compared(pool: Pool) -> pd.DataFrame:
    rows = [
        {
            "effects": " + ".join(one.kinds) or "none",
            "chi2_per_datum": one.chi2_per_datum,
            "log_evidence": one.fit.log_evidence,
            "log_odds": pool.log_odds(one),
        }
        for one in pool.distinct()
    ]
    return pd.DataFrame(rows)
