"""A measured free-free beam of which length, mass and positions were not recorded.

Three accelerances of a slender uniform beam, one response point and three hammer impacts, 0 to
1000 Hz. Unknown: stiffness, mass, all four positions, in units of the length, and by how much the
mode shapes differ from those of a uniform beam. The file labels the first function as a driving
point; the posterior of the positions shows whether it is.

The measurement is not part of this project. Give the file with
`bayes-placement update models/free_free_beam.py --data measured.uff`.
"""

import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp

RESONANCES = np.array([51.5, 142.18, 278.67, 460.39, 687.17, 958.53])
"""Measured resonances [Hz]."""

ANYWHERE = bp.positions.Segment(0.5, within=0.5)


def off_resonance(spacing=15.0, clearance=0.02):
    """Lines [Hz] away from the resonances, whose peaks a spacing of 1 Hz does not resolve.

    The uniform beam explains the resonances to about 0.2 %, so that lines closer to a resonance
    than ten times that would compare the flanks of two shifted peaks.
    """
    lines = np.arange(25.0, 1000.0, spacing)
    distance = np.abs(lines[:, None] - RESONANCES) / RESONANCES
    return lines[np.all(distance > clearance, axis=1)]


# Length, section and material enter as a frequency scale and a mass. With unit length, density and
# radius of gyration, youngs_modulus [1/s2] is the first and area [kg] the second.
beam = bp.Structure(
    bp.beams.beam(
        16,
        length=1.0,
        area=dist.LogUniform(1.0, 1e3),
        radius_of_gyration=1.0,
        youngs_modulus=dist.Uniform(150.0, 300.0),
        density=1.0,
        ends="free-free",
        direction=1,  # as recorded in the file
    ),
    damping=bp.damping.Modal(1e-3),  # negligible away from the resonances
)

experiment = bp.Experiment(
    beam,
    sensors=[bp.Sensor("1", at=ANYWHERE)],
    actuators=[bp.Actuator(name, at=ANYWHERE) for name in ("1", "2", "3")],
    frequency=off_resonance(),
    observe=bp.observe.LogAmplitude("acceleration"),
    noise=bp.noise.Gaussian(dist.LogUniform(2e-3, 0.5)),
    model_error=bp.model_error.Embedded(
        frequency=dist.LogUniform(1e-4, 1e-2),
        shape=dist.LogUniform(1e-3, 0.3),
        damping=None,
        gain=None,
        stiffness_and_mass=None,
    ),
)

engine = bp.engines.MAP(starts=64, search="evolutionary")
"""Descents from anywhere end at wrong positions. Of the two mirror images, which explain the data
alike, one is found.
"""
