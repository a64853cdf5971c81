"""Benchmark: `explain` beside least squares of SciPy for every candidate from the same starts.

Run with `python -m pytest tests/benchmarks/test_explain.py -n 0`.
"""

import json
import time

import numpy as np
from scipy.optimize import least_squares

import bayes_placement as bp
from tests.benchmarks.fresh import told_by
from tests.benchmarks.page import Anchor, at_least


def test_explain_beside_exhaustive_least_squares(page, tmp_path):
    took = told_by("tests.benchmarks.test_explain", folder=tmp_path)
    anchor = Anchor(f"SciPy, {took['fits']} fits", took["scipy"])
    page.add("explain, bar with three sensors", took["explain"], "s", at_least(5), anchor=anchor)
    assert took["cost"] < took["scipy cost"] + 0.5


def both():
    """Seconds of `explain` and of SciPy, with all that is compiled, and the least cost of each."""
    from models import hidden_effect

    experiment, measurement = hidden_effect.experiment, hidden_effect.measurement
    began = time.perf_counter()
    ranking = bp.explain(experiment, measurement)
    explain = time.perf_counter() - began
    problems = starts_of_candidates(experiment, measurement)
    began = time.perf_counter()
    costs = [fitted(problem, start) for problem, starts in problems for start in starts]
    least = 0.5 * ranking.steps[0].chi2_per_datum * problems[0][0].count
    return {
        "explain": explain,
        "scipy": time.perf_counter() - began,
        "fits": len(costs),
        "cost": least,
        "scipy cost": min(costs),
    }


def starts_of_candidates(experiment, measurement):
    """Problem of each candidate, and the starts from which `explain` fits those that it fits."""
    import jax

    from bayes_placement.criticism.missing._candidates import candidates_of
    from bayes_placement.criticism.missing._descents import FOLLOWED
    from bayes_placement.criticism.missing._hypotheses import null_hypothesis
    from bayes_placement.criticism.missing._scanned_candidates import _weak_start, scanned

    null = null_hypothesis(experiment, experiment.data(measurement))
    pairs = [(null, effect) for effect in candidates_of(experiment, None)]
    problems = []
    for candidate in scanned(pairs, lambda: None):
        weak = _weak_start(candidate.effect, candidate.problem, null)
        problems.append((candidate.problem, [*candidate.best_places(FOLLOWED), weak]))
    jax.clear_caches()  # what is compiled is part of what is measured
    return problems


def fitted(problem, start):
    """Half the sum of squares at the end of a descent of SciPy, its slopes by differences."""

    (state,) = problem._parts  # one point alone, where `explain` evaluates batches

    def residual(point):
        return np.concatenate([np.asarray(state._of_batch(point[None], False)[0])[0], point])

    fit = least_squares(residual, start, bounds=(-5.0, 5.0))
    return 0.5 * float(np.sum(residual(fit.x)[: -len(start)] ** 2))


if __name__ == "__main__":
    print(json.dumps(both()))
