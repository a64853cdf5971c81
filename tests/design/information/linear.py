"""A linear experiment with normal unknowns, whose information is known in closed form."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp


class Offsets(bp.effects.InstrumentEffect):
    """FRFs of known form that are added, each with an unknown factor: a linear experiment."""

    absent: ClassVar = ("factor", 0.0)
    factor: Any
    forms: np.ndarray
    name: str = eqx.field(static=True, default="offsets", kw_only=True)

    def recorded(self, frf, omega, channels):
        return frf + jnp.asarray(self.factor) @ jnp.asarray(self.forms)

    @classmethod
    def suggest(cls, scales):
        return []


FORMS, SCALES, SIGMA = np.array([[1.0, 0.4, -0.3], [0.2, 0.9, 0.5]]), np.array([0.7, 1.5]), 0.4


def linear_experiment(forms=FORMS, scales=SCALES, sigma=SIGMA):
    """Two normal unknowns, three complex lines of which the real parts tell; or other forms."""
    beam = bp.beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    experiment = bp.Experiment(
        bp.Structure(beam, damping=bp.damping.Modal(0.04)),
        sensors=[bp.Sensor("s1", at=0.3)],
        actuators=[bp.Actuator("a1", at=0.6)],
        frequency=100.0 * np.arange(1, forms.shape[1] + 1),
        observe=bp.observe.Complex("displacement"),
        noise=bp.noise.Gaussian(sigma),
    )
    prior = dist.Normal(jnp.zeros(2), jnp.asarray(scales)).to_event(1)
    return experiment + Offsets(prior, forms)
