"""A bar on which somebody left a clamp, and a model that knows nothing of it.

A uniform bar, fixed at both ends, is driven at one place and read at three by one roved sensor,
each within 3 cm of its record. Unknown: Young's modulus, the damping ratio and the four places.
No value of these explains the data, since the model lacks the clamp. What is it that is missing,
where does it sit, and how much does the error fall once it is added? Ask with
`bayes-placement improve models/hidden_effect.py`.

The data in hidden_effect.uff are simulated by hidden_effect_measurement.py, a finite element model
that shares no code with this package; hidden_effect_truth.json holds what was hidden.
"""

import json
from pathlib import Path

import numpyro.distributions as dist

import bayes_placement as bp

HERE = Path(__file__).parent

PLACES = {"s1": 0.16, "s2": 0.47, "s3": 0.71, "a1": 0.25}
"""Recorded positions [m]."""


def at(name):
    """Return where a transducer may sit: within 3 cm of its record."""
    return bp.positions.Segment(PLACES[name], within=0.03)


def bar():
    """Return the bar as drawn: stiffness and damping uncertain, and nothing attached."""
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
    known = json.loads((HERE / "hidden_effect_truth.json").read_text())
    places = {
        f"{kind}.{one['name']}.position": one["true_position_m"]
        for kind, ones in [("sensor", known["sensors"]), ("actuator", [known["actuator"]])]
        for one in ones
    }
    return {
        "structure.modes.youngs_modulus": known["structure"]["youngs_modulus_Pa"],
        "structure.damping.ratio": known["damping_ratio"],
        **places,
    }


truth = _truth()
