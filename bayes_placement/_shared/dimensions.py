"""Words of annotations, parameters and arrays by their dimensions; names within labelled arrays."""

from typing import Any

import numpy as np
from jaxtyping import Array, Complex, Float
from numpyro.distributions import Distribution

Parameter = float | int | Array | np.ndarray | Distribution
"""A number, an array, or a distribution where the number is not known."""

Shapes = Float[Array, "channel mode"]
Spectrum = Float[np.ndarray, "frequency"]
ComplexSpectrum = Complex[np.ndarray, "frequency"]
Receptance = Complex[Array, "sensor actuator *force_level frequency"]
Response = Float[Array, "sensor actuator *level_and_part frequency"]
Key = Any


FORCE_LEVEL = "force_level"
"""Dimension of the force amplitudes [N], which outputs have where the experiment states them."""

AS_DRAWN, AS_GIVEN = "as drawn", "as given"
"""Names of the model at recorded positions and means of priors, and of the same once fitted."""

ABOUT = "about"
"""Attribute of the findings of a run: words on it, as JSON."""
