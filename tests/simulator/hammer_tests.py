"""Hammer tests of a bar, integrated in time.

Independent of bayes_placement: modes of fine elements, stepped by SciPy's matrix exponential, with
whatever is attached to the bar in their equations of motion. SI units.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import signal

from tests.simulator.fine_elements import Line, damping_ratios, plant

MODES = 120
STEPS = 8
"""Steps of the integration for each sample."""


@dataclass(frozen=True)
class Pulse:
    """A hit of a hammer: its greatest force [N], when it is reached and its deviation [s]."""

    force: float
    time: float
    width: float = 1.5e-4

    def at(self, time: np.ndarray) -> np.ndarray:
        return self.force * np.exp(-(((time - self.time) / self.width) ** 2) / 2)


@dataclass(frozen=True)
class Signals:
    """Force [N] and accelerations [m/s^2] of each sensor, without noise."""

    rate: float
    force: np.ndarray
    response: np.ndarray  # (sensor, sample)


def hammered(
    line: Line,
    sensors: Sequence[float],
    place: float,
    pulses: Sequence[Pulse],
    *,
    duration: float,
    rate: float,
    mass: float = 0.0,
    mass_at: float = 0.5,
) -> Signals:
    """Integrate the motion of a bar that is hit at one place, with a mass attached at another."""
    bar = plant(line, loaded=(place, mass_at))
    natural, read, hit, attached = (
        bar.natural[:MODES],
        bar.rows(sensors)[:, :MODES],
        bar.rows([place])[0, :MODES],
        bar.rows([mass_at])[0, :MODES],
    )
    inertia = np.eye(MODES) + mass * np.outer(attached, attached)
    losses = np.diag(2 * damping_ratios(line, MODES) * natural)
    accelerations = np.linalg.solve(inertia, np.column_stack([np.diag(-(natural**2)), -losses]))
    pushed = np.linalg.solve(inertia, hit)
    system = signal.StateSpace(
        np.block([[np.zeros((MODES, MODES)), np.eye(MODES)], [accelerations]]),
        np.concatenate([np.zeros(MODES), pushed])[:, None],
        read @ accelerations,
        (read @ pushed)[:, None],
    )
    time = np.arange(round(duration * rate) * STEPS) / (rate * STEPS)
    force = sum(pulse.at(time) for pulse in pulses)
    _, motion, _ = signal.lsim(system, force, time)
    return Signals(rate, force[::STEPS], motion[::STEPS].T)
