"""Modal parameters of bars by finite elements, an independent solution, and experiments of them."""

import numpy as np
import numpyro.distributions as dist
from scipy.linalg import eig, eigh

import bayes_placement as bp

MODULUS, DENSITY, AREA = 1e9, 9000.0, 1e-3
ELEMENTS = 100


def matrices():
    """Stiffness and mass of a bar of 1 m held at both ends, of fourth order in the element."""
    size = 1 / ELEMENTS
    stiffness, mass = np.zeros((2, ELEMENTS + 1, ELEMENTS + 1))
    for element in range(ELEMENTS):
        here = slice(element, element + 2)
        stiffness[here, here] += MODULUS * AREA / size * np.array([[1, -1], [-1, 1]])
        mass[here, here] += DENSITY * AREA * size / 12 * np.array([[5, 1], [1, 5]])
    return stiffness[1:-1, 1:-1], mass[1:-1, 1:-1]


def poles(count, *, ratio=0.0, mass_at=None, mass=0.0, dashpot_at=None, dashpot=0.0):
    """Natural frequencies [Hz], damping ratios and complex shapes at all inner nodes."""
    stiffness, inertia = matrices()
    squares, shapes = eigh(stiffness, inertia)
    damping = inertia @ shapes @ np.diag(2 * ratio * np.sqrt(squares)) @ shapes.T @ inertia
    if mass_at is not None:
        inertia[node(mass_at), node(mass_at)] += mass
    if dashpot_at is not None:
        damping[node(dashpot_at), node(dashpot_at)] += dashpot
    zero, identity = np.zeros_like(inertia), np.eye(len(inertia))
    state = np.block([[zero, identity], [-stiffness, -damping]])
    values, vectors = eig(state, np.block([[identity, zero], [zero, inertia]]))
    upper = np.flatnonzero(values.imag > 1)
    chosen = upper[np.argsort(np.abs(values[upper]))][:count]
    pole = values[chosen]
    size = np.abs(pole)
    shapes = vectors[: len(inertia), chosen]
    phase = np.sqrt(np.sum(shapes**2, axis=0))  # LAPACK leaves any
    return size / (2 * np.pi), -pole.real / size, shapes / phase


def node(place):
    """Number of the inner node at a place."""
    number = round(place * ELEMENTS)
    assert abs(number - place * ELEMENTS) < 1e-9
    return number - 1


def measured(places, count, *, noise=None, frequency=1e-3, damping=2e-4, shape=0.02, **structure):
    """Modal parameters at places, with errors of stated deviations from a generator."""
    natural, ratio, shapes = poles(count, **structure)
    real = shapes[[node(place) for place in places]].real
    deviations = frequency * natural, np.full(count, damping), shape * np.ones_like(real)
    deviations[2][:] *= np.abs(real).max(axis=0)
    drawn = [
        values + (0 if noise is None else noise.standard_normal(values.shape)) * deviation
        for values, deviation in zip((natural, ratio, real), deviations, strict=True)
    ]
    return bp.ModalParameters(
        drawn[0],
        deviations[0],
        damping_ratio=drawn[1],
        damping_ratio_deviation=deviations[1],
        shape=drawn[2],
        shape_deviation=deviations[2],
        sensors=[f"s{number}" for number in range(len(places))],
    )


def experiment(measurement, places, *, modulus=MODULUS, ratio=0.01, within=None, modes=20):
    """The bar with sensors at places, known or within a tolerance, that observes modes."""
    bar = bp.beams.bar(modes, length=1.0, area=AREA, youngs_modulus=modulus, density=DENSITY)
    at = [
        float(place) if within is None else bp.positions.Segment(float(place), within=within)
        for place in places
    ]
    return bp.Experiment(
        bp.Structure(bar, damping=bp.damping.Modal(ratio)),
        sensors=[bp.Sensor(f"s{number}", at=place) for number, place in enumerate(at)],
        observe=bp.observe.ModalData(measurement),
        noise=bp.noise.FromVariance(),
    )


def unknown_modulus():
    """Prior of the modulus."""
    return dist.Uniform(0.8 * MODULUS, 1.2 * MODULUS)
