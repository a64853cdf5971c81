"""Sizes to which default priors are scaled, against what is known of uniform structures."""

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.effects import Scales

SECTION = {"area": 8e-4, "youngs_modulus": 7e10, "density": 2700.0}
MASS = 1.2 * SECTION["area"] * SECTION["density"]
BENDING = SECTION | {"second_moment": 5e-9}


def scales(modes: bp.modes.Modes) -> Scales:
    return Scales(
        bp.Experiment(
            bp.Structure(modes, damping=bp.damping.Modal(0.01)),
            sensors=[bp.Sensor("s1", at=0.31)],
            actuators=[bp.Actuator("a1", at=0.83)],
            frequency=np.array([10.0, 100.0]),
            observe=bp.observe.Complex("displacement"),
            noise=bp.noise.Gaussian(1.0),
        )
    )


@pytest.mark.parametrize("ends", ["fixed-free", "free-free", "fixed-fixed"])
def test_mass_of_a_uniform_bar(ends):
    bar = bp.modes.beams.bar(length=1.2, ends=ends, modes=6, **SECTION)
    assert scales(bar).mass == pytest.approx(MASS, rel=1e-6)


@pytest.mark.parametrize("ends", ["free-free", "fixed-free", "pinned-pinned", "fixed-fixed"])
def test_mass_of_a_uniform_beam(ends):
    beam = bp.modes.beams.beam(length=1.2, ends=ends, modes=6, **BENDING)
    assert scales(beam).mass == pytest.approx(MASS, rel=0.01)
