"""Words of every annotation: parameters, and arrays by their dimensions."""

from typing import Any

import numpy as np
from jaxtyping import Array, Complex, Float
from numpyro.distributions import Distribution

from . import precision  # noqa: F401  before the first array is made

Parameter = float | int | Array | np.ndarray | Distribution
"""A number, an array, or a distribution where the number is not known."""

Shapes = Float[Array, "channel mode"]
Spectrum = Float[np.ndarray, "frequency"]
ComplexSpectrum = Complex[np.ndarray, "frequency"]
Receptance = Complex[Array, "sensor actuator *force_level frequency"]
Response = Float[Array, "sensor actuator *level_and_part frequency"]
Key = Any
