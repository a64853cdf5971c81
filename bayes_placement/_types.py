"""Dimension words of every annotation, the working precision, and our own errors."""

import os
from collections.abc import Callable
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Complex, Float
from numpyro.distributions import Distribution

LEAST_THREADS = 8
"""Least number of threads of JAX, unless it has a single one."""

# Linear algebra of a batch waits for threads of JAX while it holds one. As many such calls at once
# as there are threads wait for each other forever (jaxlib 0.10, ParallelBatchMap): on a machine of
# two cores two are enough. Idle threads cost nothing. JAX reads this when it computes first.
os.environ.setdefault("PJRT_NPROC", str(max(LEAST_THREADS, os.cpu_count() or 1)))

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


class UsageError(InputError):
    """A command that was typed wrongly, whatever the model and the data are."""


class InfeasibleError(InputError):
    """A method that cannot treat this experiment, where another one can."""


class MissingExtraError(PackageError, ImportError):
    """A library that is not installed, and the extra of this package that brings it."""


class NumericalError(PackageError, ArithmeticError):
    """A factorisation or an iteration whose result cannot be trusted."""


class WritingError(PackageError, OSError):
    """A file that the system does not let be written."""


class WorkerError(PackageError, RuntimeError):
    """A worker process that was lost, or that cannot read what it was sent."""


def check_kind(
    argument: str, value: Any, kinds: type | tuple[type, ...], needed: str, instead: str
) -> None:
    """Refuse an argument of another kind.

    Parameters
    ----------
    argument
        What was given it as, such as `noise`.
    value
        What was given.
    kinds
        Classes that it may be of.
    needed
        What is needed and why, after `; `.
    instead
        The line that fixes it.

    Raises
    ------
    InputError
        If it is of another kind.
    """
    if not isinstance(value, kinds):
        raise InputError(f"{argument}={shown(value)} was given; {needed}: {instead}.")


def check_count(argument: str, value: Any, least: int, instead: str) -> None:
    """Refuse what is no whole number, or is below a least one.

    Raises
    ------
    InputError
        If it is none.
    """
    integral = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not (integral and value >= least):
        raise InputError(
            f"{argument}={shown(value)} was given; a whole number of at least {least} is needed, "
            f"since it counts: {instead}."
        )


def finite_number(argument: str, value: Any, instead: str) -> float:
    """Return one finite number.

    Raises
    ------
    InputError
        If it is none.
    """
    number = np.asarray(value)
    if number.dtype.kind not in "iuf" or number.ndim or not np.isfinite(number):
        raise InputError(
            f"{argument}={shown(value)} was given; one finite number is needed, in SI units: "
            f"{instead}."
        )
    return float(number)


def shown(value: Any) -> str:
    """Write what was given briefly: a text or a number itself, all else by its kind."""
    if isinstance(value, str | int | float | type(None)):
        return repr(value)
    if isinstance(value, type):
        return f"the class {value.__name__}"
    if isinstance(value, list | tuple | dict | set):
        return f"{type(value).__name__} of {len(value)}"
    return f"an object of {type(value).__name__}"


def no_progress(share: float) -> None:
    """Report nothing."""
