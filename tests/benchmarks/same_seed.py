"""What comes of one seed, as JSON: `python -m tests.benchmarks.same_seed METHOD`."""

import json
import sys

import numpy as np

import bayes_placement as bp
from tests.criticism.small import MASS, experiment, measured

ENGINES = {
    "importance": lambda: bp.engines.Importance(draws=2000),
    "map": lambda: bp.engines.MAP(starts=4, draws=100),
    "smc": lambda: bp.engines.SMC(particles=100),
    "nuts": lambda: bp.engines.NUTS(chains=2, warmup=100, draws=50),
}
METHODS = [*ENGINES, "improve"]


def told(method):
    """Numbers of a method, all of them, as exact as they are."""
    measurement = measured(MASS, seed=1)
    if method == "improve":
        candidates = bp.effects.library(experiment(), ["point_mass", "gain_error"])
        ledger = bp.improve(experiment(), measurement, candidates=candidates)
        last = ledger.steps[-1]
        ends = [[value.low, value.high] for value in last.parameters.values()]
        return {"evidence": last.log_evidence, "ends": ends}
    posterior = bp.infer(experiment() + MASS, measurement, engine=ENGINES[method](), key=5)
    draws = posterior["posterior"].to_dataset()
    return {name: np.ravel(draws[name].values).tolist() for name in sorted(map(str, draws))}


if __name__ == "__main__":
    print(json.dumps(told(sys.argv[1])))
