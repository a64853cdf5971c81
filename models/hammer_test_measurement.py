"""Simulated hammer test of the bar with a clamp left on it, as time records.

It writes hammer_test.wav and does not use bayes_placement: the finite elements are those of
bar_measurement, with an attached mass, and all their modes are stepped in time. One of the hits is
double.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy.linalg
from scipy import signal
from scipy.io import wavfile

try:
    from models import bar_measurement as bar
    from models import hidden_effect_measurement as clamped
except ImportError:  # as a script, this folder is searched instead of the one above it
    import bar_measurement as bar
    import hidden_effect_measurement as clamped

RATE, STEPS, DURATION = 8192, 8, 0.28  # Hz, steps of the integration in a sample, s of each hit
SENSORS = tuple(sensor["true_position_m"] for sensor in clamped.SENSORS)
PLACE = clamped.ACTUATOR["true_position_m"]

HITS, DOUBLE = 7, 3  # hits, and the number of the double one from 0
FORCES, WIDTHS = (80.0, 120.0), (1.3e-4, 1.8e-4)  # N and s: least and greatest of the hits
FORCE_NOISE, NOISE = 0.02, 0.1  # N and m/s^2
RANGE, FORCE_SENSITIVITY, SENSITIVITY = 10.0, 0.02, 0.05  # V, V/N and V/(m/s^2)
SEED = 20260321


class Pulse(NamedTuple):
    """A hit: its greatest force [N], when it is reached [s], and its standard deviation [s]."""

    force: float
    time: float
    width: float

    def at(self, time: np.ndarray) -> np.ndarray:
        """Force [N] at times [s]."""
        return self.force * np.exp(-(((time - self.time) / self.width) ** 2) / 2)


class ComplexModes(NamedTuple):
    """Poles [1/s], their residues of shape (sensor, pole), and the acceleration at once per force.

    The accelerance at s is direct + the sum of residue / (s - pole) and its conjugate.
    """

    poles: np.ndarray
    residues: np.ndarray
    direct: np.ndarray


class Signals(NamedTuple):
    """Force [N], and accelerations [m/s^2] of shape (sensor, sample), without noise."""

    force: np.ndarray
    response: np.ndarray


def bar_in_time(clamp: dict[str, float] = clamped.CLAMP) -> ComplexModes:
    """Complex modes of the bar; the clamp is in the equations of motion of those without it."""
    stiffness, mass = bar.matrices(bar.ELEMENTS)
    factor = clamped.YOUNGS_MODULUS / clamped.NOMINAL_YOUNGS_MODULUS
    eigenvalues, shapes = scipy.linalg.eigh(stiffness * factor, mass)
    places = (*SENSORS, PLACE, clamp["position_m"])
    *read, hit, attached = (bar.shape_functions(place, bar.ELEMENTS) @ shapes for place in places)
    identity = np.eye(eigenvalues.size)
    inertia = identity + clamp["mass_kg"] * np.outer(attached, attached)
    losses = np.diag(2 * clamped.DAMPING_RATIO * np.sqrt(eigenvalues))
    motion = np.linalg.solve(inertia, np.hstack([-np.diag(eigenvalues), -losses]))
    pushed = np.linalg.solve(inertia, hit)
    state = np.block([[np.zeros_like(identity), identity], [motion]])
    poles, vectors = np.linalg.eig(state)
    driven = np.linalg.solve(vectors, np.concatenate([np.zeros_like(hit), pushed]))
    residues = np.array(read) @ motion @ vectors * driven
    upper = poles.imag > 0  # the others are their conjugates
    return ComplexModes(poles[upper], residues[:, upper], np.array(read) @ pushed)


def hammered(modes: ComplexModes, pulses: Sequence[Pulse]) -> Signals:
    """Record a bar that is hit, from rest.

    Each mode x' = p x + F is exact for a force that is linear within a step.
    """
    step = 1 / (RATE * STEPS)
    time = np.arange(round(DURATION * RATE) * STEPS) * step
    force = np.sum([pulse.at(time) for pulse in pulses], axis=0)
    response = np.outer(modes.direct, force[::STEPS])
    for pole, residue in zip(modes.poles, modes.residues.T, strict=True):
        z = pole * step
        first, second = (np.exp(z) - 1) / z, (np.exp(z) - 1 - z) / z**2
        weights = step * np.array([second, first - second])
        amplitude = signal.lfilter(weights, [1.0, -np.exp(z)], force.astype(complex))
        response += 2 * np.outer(residue, amplitude[::STEPS]).real
    return Signals(force[::STEPS], response)


def hits(clamp: dict[str, float] = clamped.CLAMP, count: int = HITS) -> list[Signals]:
    """Hits of other strengths and widths; one of them is double."""
    generator = np.random.default_rng(SEED)
    modes = bar_in_time(clamp)
    recorded = []
    for number in range(count):
        first = Pulse(generator.uniform(*FORCES), 0.01, generator.uniform(*WIDTHS))
        second = Pulse(first.force / 4, first.time + 0.012, first.width)
        recorded.append(hammered(modes, [first, second] if number == DOUBLE else [first]))
    return recorded


def measured(records: Sequence[Signals], seed: int = SEED) -> Signals:
    """One record of all hits, with noise on every channel."""
    generator = np.random.default_rng(seed)
    force = np.concatenate([record.force for record in records])
    response = np.concatenate([record.response for record in records], axis=1)
    return Signals(
        force + FORCE_NOISE * generator.standard_normal(force.size),
        response + NOISE * generator.standard_normal(response.shape),
    )


def main(folder: Path) -> None:
    """Write hammer_test.wav into a folder: the force, then the sensors, 16 bits over 10 V."""
    record = measured(hits())
    volts = np.vstack([FORCE_SENSITIVITY * record.force, SENSITIVITY * record.response])
    digits = np.round(volts / RANGE * 2**15).astype(np.int16)
    wavfile.write(folder / "hammer_test.wav", RATE, digits.T)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parent)
    main(parser.parse_args().folder)
