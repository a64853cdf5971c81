"""_scales: in, an experiment; out, the sizes of its structure to which default priors are scaled.

Not known here: any single effect, data. All figures are those of the nominal structure.
"""

import itertools
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..modes.finite_elements.nodal_modes import nodal_of

Direction = tuple[float, float, float] | None
"""A direction in space; None for the only one in which the structure moves."""

PLACES = 33


def anywhere(experiment: Any) -> list[Any]:
    """Uniform laws of a place [m] that cover the structure, one for each of its pieces."""
    return experiment.structure.modes.anywhere()


def somewhere_along(experiment: Any) -> list[tuple[Any, Direction]]:
    """Return every piece of the structure, with each axis along which it moves."""
    axes = experiment.structure.modes.axes
    directions = [None] if len(axes) == 1 else [_unit(axis) for axis in axes]
    return list(itertools.product(anywhere(experiment), directions))


def _unit(axis: int) -> Direction:
    x, y, z = (float(axis == one) for one in (1, 2, 3))
    return x, y, z


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
    nodal = nodal_of(modes)
    if nodal is not None:
        return nodal.mass
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
