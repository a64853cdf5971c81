"""Parts of a finite element model that effects are named after: supports, regions, members."""

from collections.abc import Sequence
from typing import Any

from ..modes.changed import nodal_below
from ..modes.modes import Modes
from ..positions.vectors import Coordinates


def name_of(part: Any, names: Sequence[str]) -> str:
    """Name of a part, from its name or number."""
    return part if isinstance(part, str) else names[int(part)]


def centre(modes: Modes, name: str) -> Coordinates | None:
    """Centre of a part [m]; None where it is not known."""
    return dict(nodal_below(modes).centres).get(name)
