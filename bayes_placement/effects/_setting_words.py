"""Words for the place, the direction and the channel that an effect acts on."""

from collections.abc import Sequence

import numpy as np

from .._shared.sites import is_unknown
from ..positions.at import At
from ..positions.bounds import Bounds, in_space
from ..positions.channel import Channel
from ..positions.places import Cartesian, OnMember, Place
from ..positions.tolerances import Tolerance
from ..positions.vectors import Vector
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
