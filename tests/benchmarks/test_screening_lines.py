"""Benchmark: effects screened at some of many lines, beside all lines; the loss of evidence.

Run with `python -m pytest tests/benchmarks/test_screening_lines.py -n 0`.
"""

import json
import sys
import time

import numpy as np

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement.inference.chi2 import LEVEL
from models import hidden_effect
from tests.benchmarks.fresh import told_by
from tests.benchmarks.page import Anchor, at_most

MODULE = "tests.benchmarks.test_screening_lines"
LINES, SENSORS = 4000, (0.16, 0.31, 0.47, 0.58, 0.71, 0.86)
TRUTH = {
    "structure.modes.youngs_modulus": 1.02e9,
    "structure.damping.ratio": 0.03,
    "actuator.a1.position": 0.263,
}
KINDS = ("point_mass", "ground_spring", "gain_error", "local_stiffness_loss")


def test_screening_at_some_lines_beside_all(page, tmp_path):
    few, all_lines = (told_by(MODULE, which, folder=tmp_path / which) for which in ("some", "all"))
    anchor = Anchor("at all lines", all_lines["seconds"])
    name = f"four kinds, {few['data']} data"
    page.add(f"{name}, screened at some lines", few["seconds"], "s", anchor=anchor)
    best = max(all_lines["evidence"], key=all_lines["evidence"].get)
    lost = all_lines["evidence"][best] - few["evidence"][best]
    page.add(f"{name}, log evidence lost by the best", lost, "nats", at_most(0.01))
    others = [
        (all_lines["evidence"][kind] - evidence) / few["chi2"][kind]
        for kind, evidence in few["evidence"].items()
    ]
    page.add(f"{name}, greatest loss of any over its chi2", max(others), "nats", at_most(1.0))


def fitted(which):
    """Seconds, and log evidence and chi2 of each kind alone."""
    from bayes_placement.criticism import screening_lines
    from bayes_placement.criticism.missing._hypotheses import null_hypothesis
    from bayes_placement.criticism.missing._more_effects import single_effects, with_channels

    if which == "all":
        screening_lines.MOST_DATA = sys.maxsize
    experiment, data = asked()
    candidates = bp.effects.library(experiment, KINDS).effects
    began = time.perf_counter()
    null = null_hypothesis(experiment, data)
    scanned = single_effects(null, candidates, lambda: None)
    singles = with_channels(scanned, LEVEL, needs_all=True).distinct()
    seconds = time.perf_counter() - began
    kinds = ["+".join(each.kinds) or "nothing" for each in singles]
    return {
        "seconds": seconds,
        "data": null.problem.count,
        "evidence": dict(zip(kinds, (each.fit.log_evidence for each in singles), strict=True)),
        "chi2": dict(zip(kinds, (max(1.0, each.chi2_per_datum) for each in singles), strict=True)),
    }


def asked():
    """A bar at many lines, and data of the same bar with a mass that its model lacks."""
    experiment = bp.Experiment(
        hidden_effect.bar(),
        sensors=[
            bp.Sensor(f"s{number}", at=bp.positions.Segment(place, within=0.03))
            for number, place in enumerate(SENSORS, start=1)
        ],
        actuators=[bp.Actuator("a1", at=bp.positions.Segment(0.25, within=0.03))],
        frequency=np.linspace(5.0, 1200.0, LINES),
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromVariance(),
    )
    random = np.random.default_rng(0)
    where = {
        f"sensor.s{number}.position": place + random.uniform(-0.02, 0.02)
        for number, place in enumerate(SENSORS, start=1)
    }
    true = experiment.fix(TRUTH | where) + bp.effects.point_mass(0.63, 0.12)
    exact = np.asarray(compiled(bp.Experiment.frf)(true))
    variance = (0.02 * np.abs(exact)) ** 2
    noise = random.standard_normal((2, *exact.shape)) * np.sqrt(variance / 2)
    measurement = bp.Measurement.from_arrays(
        exact + noise[0] + 1j * noise[1],
        experiment.frequency,
        sensors=experiment.sensor_channels,
        actuators=experiment.actuator_channels,
        quantity="accelerance",
        variance=variance,
    )
    return experiment, experiment.data(measurement)


if __name__ == "__main__":
    print(json.dumps(fitted(sys.argv[1])))
