"""Directions in which effects at a place act: they point somewhere, and the structure moves so."""

from collections.abc import Sequence

import numpy as np

from .._shared.arguments import shown
from .._shared.errors import InputError
from .._shared.sites import is_open

_ACROSS = 1e-9  # of the length of a direction, below which a component of it is rounding


def check_direction(effect: str, direction: Sequence[object] | None, axes: Sequence[int]) -> None:
    """Refuse a direction that points nowhere, or across every motion of the structure.

    What is a distribution, or computed, is not known yet and passes.
    """
    if direction is None:
        return
    along = _unit(axes[0])
    values = [0.0 if is_open(component) else component for component in direction]
    if len(values) != 3 or not all(_is_finite(value) for value in values):
        raise InputError(
            f'Effect "{effect}": direction={_text(direction)} was given; three finite numbers '
            f"along x, y and z are needed, since no force follows from others: direction={along}."
        )
    open_ones = [is_open(component) for component in direction]
    vector = np.array(values, float)
    length = np.linalg.norm(vector)
    if not any(open_ones) and not 0 < length < np.inf:
        raise InputError(
            f'Effect "{effect}": direction={_text(direction)} was given; a vector of a length '
            f"above zero is needed, since it tells where the force points: direction={along}."
        )
    moved = [axis - 1 for axis in axes]
    is_felt = any(open_ones[axis] or abs(vector[axis]) > _ACROSS * length for axis in moved)
    if not is_felt:
        motions = " and ".join("xyz"[axis] for axis in moved)
        raise InputError(
            f'Effect "{effect}": direction={_text(direction)} was given; a direction with a '
            f"component along {motions} is needed, since the structure moves along {motions} only "
            f"and does not feel others: direction={along}."
        )


def _is_finite(value: object) -> bool:
    number = np.asarray(value)
    return number.dtype.kind in "iuf" and number.ndim == 0 and bool(np.isfinite(number))


def _unit(axis: int) -> str:
    """Write the unit vector along an axis."""
    return str(tuple(float(number == axis) for number in (1, 2, 3)))


def _text(direction: Sequence[object]) -> str:
    words = [
        f"{np.asarray(component):g}"
        if not is_open(component) and _is_finite(component)
        else shown(component)
        for component in direction
    ]
    return f"({', '.join(words)})"
