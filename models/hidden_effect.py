"""A bar on which a clamp was left, and a model without it.

A uniform bar, fixed at both ends, is excited at one point and measured at three by a roved sensor,
each within 3 cm of its recorded position. Unknown: Young's modulus, the damping ratio and the four
positions. No values of these explain the data, since the model lacks the clamp. Which effect is
missing, where is it, and how far does the error fall when it is added?
`bayes-placement improve models/hidden_effect.py` answers.

The data in hidden_effect.uff are simulated by hidden_effect_measurement.py, a finite element model
that shares no code with this package; hidden_effect_truth.json holds the true values.
"""

import json
from pathlib import Path

import numpyro.distributions as dist

import bayes_placement as bp

HERE = Path(__file__).parent

PLACES = {"s1": 0.16, "s2": 0.47, "s3": 0.71, "a1": 0.25}
"""Recorded positions [m]."""


def at(name):
    """Position of a transducer: within 3 cm of the recorded position."""
    return bp.positions.Segment(PLACES[name], within=0.03)


def bar():
    """Nominal bar: stiffness and damping uncertain, and nothing attached."""
    modes = bp.beams.bar(
        60,
        length=1.0,
        area=1e-3,
        youngs_modulus=dist.Uniform(0.92e9, 1.08e9),
        density=9000.0,
    )
    return bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.02, 0.08)))


measurement = bp.io.uff.read(HERE / "hidden_effect.uff")

experiment = bp.Experiment(
    bar(),
    sensors=[bp.Sensor(name, at=at(name)) for name in ("s1", "s2", "s3")],
    actuators=[bp.Actuator("a1", at=at("a1"))],
    frequency=measurement.frequency,
    observe=bp.observe.Complex("acceleration"),
    noise=bp.noise.FromCoherence(),
)


def _truth():
    stated = json.loads((HERE / "hidden_effect_truth.json").read_text())
    sides = {"sensor": stated["sensors"], "actuator": [stated["actuator"]]}
    positions = {
        f"{side}.{transducer['name']}.position": transducer["true_position_m"]
        for side, transducers in sides.items()
        for transducer in transducers
    }
    return {
        "structure.modes.youngs_modulus": stated["structure"]["youngs_modulus_Pa"],
        "structure.damping.ratio": stated["damping_ratio"],
        **positions,
    }


truth = _truth()
