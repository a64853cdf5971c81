"""The bar of the paper's section 5: its damping, inferred from a measured response.

A uniform bar, fixed at both ends, is excited at one point and measured at another. Both positions
were recorded, with a tolerance of 4 cm. Unknown: the damping ratios of the first two modes and both
positions.

The data in bar.uff are simulated by bar_measurement.py, a finite element model that shares no
code with this package: another discretisation, 1 % noise, and positions other than the recorded.
"""

import json
from pathlib import Path

import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp

PRIOR = dist.Uniform(0.02, 0.06)
PAPER_LINES = (np.arange(1, 11) - 0.5) * 43.3
"""Midpoints of ten equal bands of [0, 433] Hz; at 0 Hz the logarithm is infinite."""

HERE = Path(__file__).parent


def bar(first=PRIOR, second=PRIOR, *, static_correction=False):
    """Bar of section 5.1 with the damping ratios of its first two modes.

    The paper sums fifteen modes; the static correction adds the flexibility of all further modes.
    """
    modes = bp.beams.bar(
        15,
        length=1.0,
        area=1e-3,
        youngs_modulus=1e9,
        density=9000.0,
        static_correction=static_correction,
    )
    return bp.Structure(modes, damping=bp.damping.Modal([first, second, 0.04]))


def placed(sensor, actuator, noise, *, frequency=PAPER_LINES, structure=None):
    """Experiment with both transducers within 4 cm of these positions [m]."""
    return bp.Experiment(
        bar() if structure is None else structure,
        sensors=[bp.Sensor("s1", at=bp.positions.Segment(sensor, within=0.04))],
        actuators=[bp.Actuator("a1", at=bp.positions.Segment(actuator, within=0.04))],
        frequency=frequency,
        observe=bp.observe.LogAmplitude("velocity"),
        noise=noise,
    )


experiment = placed(0.25, 0.30, bp.noise.FromCoherence(), structure=bar(static_correction=True))
measurement = bp.io.uff.read(HERE / "bar.uff")


def _truth():
    stated = json.loads((HERE / "bar_truth.json").read_text())
    first, second = stated["damping_ratios"]
    return {
        "structure.damping.ratio.1": first,
        "structure.damping.ratio.2": second,
        "sensor.s1.position": stated["sensor"]["true_position_m"],
        "actuator.a1.position": stated["actuator"]["true_position_m"],
    }


truth = _truth()
