"""Parts of a finite element model that effects are named after: supports, regions, members."""

from collections.abc import Sequence
from typing import Any

from .._types import InputError
from ..modes.modes import Modes
from ..modes.underlying import underlying_nodal_modes
from ..positions.vectors import CartesianComponents


def check_number(part: Any, names: Sequence[str]) -> None:
    """Refuse a number that no part has; arrays come from parts that were found by name."""
    if isinstance(part, int) and not 0 <= part < len(names):
        raise InputError(
            f"The part {part} was given, counted from 0, but the model has {len(names)}: "
            f"{', '.join(names) or 'none'}. Name one of them, since numbers change with the model."
        )


def name_of(part: Any, names: Sequence[str]) -> str:
    """Name of a part, from its name or number."""
    return part if isinstance(part, str) else names[int(part)]


def centre(modes: Modes, name: str) -> CartesianComponents | None:
    """Centre of a part [m]; None where it is not known."""
    return dict(underlying_nodal_modes(modes).centres).get(name)
