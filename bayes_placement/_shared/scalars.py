"""Quantities that are one number: several, or a list of them, would be spread over the lines."""

from typing import Any

import jax
import numpy as np

from .arguments import shown
from .errors import InputError
from .ranges import described
from .sites import is_unknown


def check_scalar(name: str, value: object) -> None:
    """Refuse several numbers, or a distribution of several, in the place of one."""
    if isinstance(value, list | tuple | dict):
        words = shown(value)
    elif isinstance(value, jax.core.Tracer) or not _shape(value):
        return
    else:
        given = described(value) if is_unknown(value) else shown(value)
        words = f"{given} of shape {_shape(value)}"
    raise InputError(
        f"{name}={words} was given; one number or a distribution of one number is needed, since it "
        f"is a single quantity and not one for each line or mode: {name}=0.5."
    )


def _shape(value: Any) -> tuple[int, ...]:
    return tuple(value.shape()) if is_unknown(value) else np.shape(value)
