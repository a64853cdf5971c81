"""A cantilever with any law at a place, measured by a mesh that this package did not make."""

import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp
from tests.simulator import fine_beams
from tests.simulator.hidden_structures import record

LINES = np.geomspace(8.0, 900.0, 90)
LOSS = 0.01
SENSORS = {"s1": (0.13, 0.1325), "s2": (0.35, 0.345), "s3": (0.45, 0.4525)}
"""Recorded and true place [m]."""
DRIVEN = (0.22, 0.225)
FURTHER = (0.52, 0.5175)
"""Of a second actuator."""
AT = 0.28


def experiment(observe=None, driven=(DRIVEN,)):
    modes = bp.beams.beam(
        12,
        length=fine_beams.LENGTH,
        area=fine_beams.AREA,
        second_moment=fine_beams.MOMENT,
        youngs_modulus=dist.Uniform(0.94 * fine_beams.STIFFNESS, 1.06 * fine_beams.STIFFNESS),
        density=fine_beams.DENSITY,
        ends="fixed-free",
    )
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Structural(LOSS)),
        sensors=[
            bp.Sensor(name, at=bp.positions.Segment(recorded, within=0.01))
            for name, (recorded, _) in SENSORS.items()
        ],
        actuators=[
            bp.Actuator(f"a{number}", at=bp.positions.Segment(recorded, within=0.01))
            for number, (recorded, _) in enumerate(driven, 1)
        ],
        frequency=LINES,
        observe=observe or bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
    )


def measured(law=None, slope=False, seed=0, others=(), driven=(DRIVEN,), factor=1.0, spread=None):
    """FRFs with a law [N/m] on the deflection, or on the slope [N m/rad], noise of 1 %.

    Others are laws on the deflection at places of their own. A factor is on the record [sensor,
    actuator, frequency]. What is `spread` is a law, and the matrix that it multiplies.
    """
    omega = 2 * np.pi * LINES
    stiffness, _ = fine_beams.matrices()
    terms = [(other, fine_beams.outer(fine_beams.row(place))) for place, other in others]
    if law is not None:
        terms.append((law, fine_beams.outer(fine_beams.row(AT, slope=slope))))
    if spread is not None:
        terms.append(spread)

    def added(w):
        return sum((term(w) * matrix for term, matrix in terms), 1j * LOSS * stiffness)

    places = [true for _, true in [*SENSORS.values(), *driven]]
    rows, columns = slice(len(SENSORS)), slice(len(SENSORS), None)
    exact = fine_beams.receptance(places, omega, added)[rows, columns] * -(omega**2)
    taken = record(exact * factor, LINES, np.random.default_rng(seed))
    setup = experiment(driven=driven)
    return bp.Measurement.from_arrays(
        taken.frf,
        LINES,
        sensors=setup.sensor_channels,
        actuators=setup.actuator_channels,
        quantity="accelerance",
        coherence=taken.coherence,
        averages=taken.averages,
    )


def maxwell(omega, stiffness=4e3, viscosity=6.0):
    return 1 / (1 / stiffness + 1 / (1j * omega * viscosity))


def spring_on_slope(omega, stiffness=40.0):
    return stiffness + 0j * omega
