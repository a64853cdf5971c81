"""One oscillator hit by a hammer, by SciPy's integrator, and its FRF in closed form."""

import numpy as np
from scipy import signal

RATE, STEPS = 4096.0, 16
MASS, NATURAL, DAMPING = 2.0, 2 * np.pi * 100.0, 0.02


def accelerance(s):
    """Acceleration per force [(m/s^2)/N] at a complex frequency s [rad/s]."""
    return s**2 / (s**2 + 2 * DAMPING * NATURAL * s + NATURAL**2) / MASS


def pulse(time, force=100.0, at=0.02, width=3e-4):
    return force * np.exp(-(((time - at) / width) ** 2) / 2)


def times(duration):
    return np.arange(round(duration * RATE)) / RATE


def hit(duration, **about):
    """Force [N] and acceleration [m/s^2] after a hit, sampled without noise."""
    time = np.arange(round(duration * RATE) * STEPS) / (RATE * STEPS)
    force = pulse(time, **about)
    return force[::STEPS], response(force, time)[::STEPS]


def response(force, time):
    system = signal.StateSpace(
        [[0.0, 1.0], [-(NATURAL**2), -2 * DAMPING * NATURAL]],
        [[0.0], [1 / MASS]],
        [[-(NATURAL**2), -2 * DAMPING * NATURAL]],
        [[1 / MASS]],
    )
    return signal.lsim(system, force, time)[1]
