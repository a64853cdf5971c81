"""Mass that modes move, estimated from their shapes."""

from typing import TypeAlias

import numpy as np
from jaxtyping import Array, Float

Squares: TypeAlias = Float[np.ndarray, "place mode"] | Float[Array, "place mode"]


def moved_mass(squares: Squares) -> float:
    """Estimate the mass of a structure [kg] from shapes at places spread evenly over it.

    The mean square over a uniform structure of a mass-normalised shape is one over its mass. The
    median over the modes passes over the few that move one part only.

    Parameters
    ----------
    squares
        Squares of mass-normalised shapes [1/kg], summed over directions, at each place.
    """
    return float(1 / np.median(np.mean(np.asarray(squares, float), axis=0)))
