"""Words for the place, the direction and the channel that an effect acts on."""

from collections.abc import Sequence

import numpy as np

from .._shared.arguments import shown
from .._shared.errors import InputError
from .._shared.sites import is_open, is_unknown
from ..positions.at import At
from ..positions.bounds import Bounds, in_space
from ..positions.channel import Channel
from ..positions.places import Cartesian, OnMember, Place
from ..positions.tolerances import Tolerance
from ..positions.vectors import Vector, triple, unit_vector
from .instruments import Number


def joined(*phrases: str) -> str:
    """Join the phrases that are not empty."""
    return ", ".join(phrase for phrase in phrases if phrase)


def channel(direction: Number | None) -> str:
    """Recorded direction of a channel: channel +x."""
    return "" if direction is None else f"channel {Channel('', int(direction)).label}"


def along(direction: Sequence[object] | np.ndarray | None) -> str:
    """Direction in which something acts: along y, along -z, along (0.6, 0, 0.8)."""
    if direction is None or any(is_unknown(component) for component in direction):
        return ""
    vector = np.array(direction, float)
    for axis, letter in enumerate("xyz"):
        if np.count_nonzero(vector) == 1 and vector[axis]:
            return f"along {'-' if vector[axis] < 0 else ''}{letter}"
    return f"along {_triple(vector)}"


def place(at: At, bounds: Bounds) -> str:
    """What is known of a place before any data: its piece of the structure, or where it is."""
    if isinstance(at, Tolerance) or is_unknown(at):
        return ""
    if isinstance(at, Cartesian):
        return _known_coordinates(at, bounds)
    if isinstance(at, OnMember):
        return f"on the member from {_triple(at.start)} m along {_triple(at.direction)}"
    return "" if in_space(bounds) or isinstance(at, Place) else f"at {np.asarray(at, float):.4g} m"


def _known_coordinates(at: Cartesian, bounds: Bounds) -> str:
    """Coordinates that are known, along the axes in which the structure extends."""
    pairs = zip("xyz", (at.x, at.y, at.z), *bounds, strict=True)
    known = [
        f"{letter} = {float(value):.4g}"
        for letter, value, low, high in pairs
        if low < high and not is_unknown(value)
    ]
    return f"at {', '.join(known)} m" if known else ""


def _triple(vector: Vector) -> str:
    return f"({', '.join(f'{float(component):.3g}' for component in vector)})"


_ACROSS = 1e-9  # of the length of a direction, below which a component of it is rounding


def check_direction(effect: str, direction: Sequence[object] | None, axes: Sequence[int]) -> None:
    """Refuse a direction that points nowhere, or across every motion of the structure.

    What is a distribution, or computed, is not known yet and passes.
    """
    if direction is None:
        return
    along = triple(unit_vector(axes[0]))
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


def _text(direction: Sequence[object]) -> str:
    words = [
        f"{np.asarray(component):g}"
        if not is_open(component) and _is_finite(component)
        else shown(component)
        for component in direction
    ]
    return f"({', '.join(words)})"
