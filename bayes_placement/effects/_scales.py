"""_scales: in, an experiment; out, the sizes of its structure to which default priors are scaled.

Not known here: any single effect, data. All figures are those of the nominal structure.
"""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpyro.distributions import Uniform

PLACES = 33


def anywhere(experiment: Any) -> Uniform:
    """Uniform law of a place over the whole structure [m]."""
    return Uniform(*experiment.structure.modes.bounds())


def band(experiment: Any) -> tuple[float, float]:
    """Least and greatest line above 0 Hz [Hz]."""
    lines = np.asarray(experiment.frequency)
    return float(np.min(lines[lines > 0])), float(np.max(lines))


def middle(experiment: Any) -> float:
    """Geometric middle of the band, as an angular frequency [rad/s]."""
    low, high = band(experiment)
    return 2 * math.pi * math.sqrt(low * high)


def mass(experiment: Any) -> float:
    """Mass that the modes move [kg]: the whole mass, for a uniform structure.

    Mass-normalised shapes have the mean square of one over the mass.
    """
    modes = experiment.nominal().structure.modes
    low, high = modes.bounds()
    places = jnp.asarray(np.linspace(low, high, PLACES))
    read = jax.jit(jax.vmap(lambda place: jnp.sum(modes.shapes(place) ** 2, axis=0)))
    return float(1 / np.mean(np.median(read(places), axis=1)))


def stiffness(experiment: Any) -> float:
    """Stiffness [N/m] that weighs as much as the mass in the middle of the band."""
    return mass(experiment) * middle(experiment) ** 2


def amplitude(experiment: Any) -> float:
    """Displacement [m] of the structure at resonance under the greatest force level."""
    nominal = experiment.nominal()
    response = np.asarray(jax.jit(lambda: nominal.receptance())())
    return float(np.nanmax(np.abs(response)) * max(experiment.force_levels))
