"""SMC and NUTS on models of other people against reference draws that Stan made (posteriordb).

Run with `python -m pytest tests/benchmarks/test_posteriordb.py -n 0 -s -m long`.
"""

import jax
import numpy as np
import pytest

from bayes_placement import engines
from bayes_placement._shared.progress import no_progress
from bayes_placement.inference.engines.engine import EngineDraws
from bayes_placement.inference.estimates import Figures, Weighting, figures
from bayes_placement.inference.unconstrained import UnconstrainedModel
from tests.benchmarks.posteriordb_models import REFERENCE, posterior

ENGINES = {"smc": engines.SMC(), "nuts": engines.NUTS()}
MOST_ERRORS = 5.0
LEAST_SHARP = 0.1
"""Greatest standard error of a mean, over the deviation, that still tells something."""

STUCK = {("arma-arma11", "nuts")}
"""Where the prior holds parameters with which errors grow beyond 1e100, chains of NUTS that start
there never move; the engine says so."""

FIELDS = ("mean", "mean_error")

pytestmark = [pytest.mark.usefixtures("optimised"), pytest.mark.long]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", REFERENCE["posteriors"])
def test_reference_draws_are_reproduced(name, engine):
    known = REFERENCE["posteriors"][name]
    run, drawn = draws(name, ENGINES[engine])
    if (name, engine) in STUCK:
        assert any("R-hat" in sentence for sentence in run.warnings)
        return
    weighting = Weighting(lineage=run.lineage)
    assert len(drawn) == len(known["names"])
    means = [figures(values, weighting) for values in drawn]
    squares = [figures(values**2, weighting) for values in drawn]
    scores = {
        statistic: errors_off(ours, known[statistic], known[f"{statistic}_error"])
        for statistic, ours in (("mean", means), ("mean_square", squares))
    }
    greatest = {statistic: np.abs(off).max() for statistic, off in scores.items()}
    print(f"{name}, {engine}: {greatest}")
    assert max(mean.mean_error / mean.sd for mean in means) < LEAST_SHARP
    assert max(greatest.values()) < MOST_ERRORS


def draws(name: str, engine) -> tuple[EngineDraws, list[np.ndarray]]:
    """What an engine returns, and draws [chain, draw] of each quantity of the reference."""
    model, priors, quantities = posterior(name)
    target = UnconstrainedModel(model, priors)
    run = engine.run(target, jax.random.PRNGKey(1), no_progress)
    values = jax.jit(jax.vmap(jax.vmap(lambda flat: quantities(target.constrain(flat)))))
    return run, [np.asarray(part) for part in values(run.position)]


def errors_off(ours: list[Figures], reference: list[float], error: list[float]) -> np.ndarray:
    """Differences of means over their standard errors, those of the reference among them."""
    mean, mean_error = (np.array([getattr(figure, name) for figure in ours]) for name in FIELDS)
    return (mean - reference) / np.hypot(mean_error, error)
