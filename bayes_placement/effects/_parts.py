"""Parts of a finite element model that effects are named after: supports, regions, members."""

from collections.abc import Sequence
from typing import Any

from ..modes.modes import Modes
from ..modes.underlying import underlying_nodal_modes
from ..positions.vectors import Coordinates


def name_of(part: Any, names: Sequence[str]) -> str:
    """Name of a part, from its name or number."""
    return part if isinstance(part, str) else names[int(part)]


def centre(modes: Modes, name: str) -> Coordinates | None:
    """Centre of a part [m]; None where it is not known."""
    return dict(underlying_nodal_modes(modes).centres).get(name)
