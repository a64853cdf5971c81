"""Dimension words of every annotation, the working precision, and our own errors."""

from collections.abc import Callable
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Complex, Float
from numpyro.distributions import Distribution

# Response amplitudes span many decades and posteriors are narrow: single precision loses both.
jax.config.update("jax_enable_x64", True)

Parameter = float | int | Array | np.ndarray | Distribution
"""A number, an array, or a distribution where the number is not known."""

Shapes = Float[Array, "channel mode"]
Receptance = Complex[Array, "sensor actuator *force_level frequency"]
Response = Float[Array, "sensor actuator *level_and_part frequency"]
Key = Any
Progress = Callable[[float], None]
"""Called with the share of the work that is done, from 0 to 1."""


class PackageError(Exception):
    """An error that this package raises: its sentence says all that a user needs."""


class InputError(PackageError, ValueError):
    """What was given, what is needed, why, and the line that fixes it."""


class InfeasibleError(InputError):
    """A method that cannot treat this experiment, where another one can."""


class MissingExtraError(PackageError, ImportError):
    """A library that is not installed, and the extra of this package that brings it."""


class NumericalError(PackageError, ArithmeticError):
    """A factorisation or an iteration whose result cannot be trusted."""


class WorkerError(PackageError, RuntimeError):
    """A worker process that was lost, or that cannot read what it was sent."""


def no_progress(share: float) -> None:
    """Report nothing."""
