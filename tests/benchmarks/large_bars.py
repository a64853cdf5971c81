"""A model of many channels and lines: CHANNELS and LINES in the environment say how many."""

import dataclasses
import os

import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp

CHANNELS, LINES = int(os.environ["CHANNELS"]), int(os.environ["LINES"])

beam = bp.beams.beam(
    40,
    length=1.0,
    area=1e-3,
    second_moment=1e-8,
    density=7800.0,
    youngs_modulus=dist.Uniform(1.9e11, 2.2e11),
)
experiment = bp.Experiment(
    bp.Structure(beam, damping=bp.damping.Modal(dist.Uniform(0.005, 0.03))),
    sensors=[
        bp.Sensor(f"s{number}", at=bp.positions.Segment(place, within=0.01))
        for number, place in enumerate(np.linspace(0.05, 0.95, CHANNELS).tolist())
    ],
    actuators=[bp.Actuator("a1", at=bp.positions.Segment(0.13, within=0.01))],
    frequency=np.linspace(20.0, 2000.0, LINES),
    observe=bp.observe.Complex("acceleration"),
    noise=bp.noise.Gaussian(0.05),
)
exact = (experiment + bp.effects.point_mass(0.4, 0.5)).nominal_measurement()
real, imaginary = 0.05 * np.random.default_rng(0).standard_normal((2, *exact.frf.shape))
measurement = dataclasses.replace(exact, frf=exact.frf + real + 1j * imaginary)
