"""placed: in, what a user says of a place; out, numbers and laws, checked against the structure.

Not known here: what is placed, beyond its name in an error.
"""

from typing import Any, TypeAlias

import numpy as np

from .._sites import is_unknown
from .._types import InputError, Parameter
from .bounds import Bounds, hair, in_space, not_a_line, not_in_space, said, words
from .places import AtNode, Cartesian, Place, Position
from .tolerances import Support

At: TypeAlias = Position | Support | tuple[Parameter, ...] | list[Parameter]
"""A place as a user may say it: a number or three, a law, a place or a support."""


def placed(at: At, bounds: Bounds, whose: str, word: str = "position") -> Position:
    """Return a place as numbers and laws.

    Parameters
    ----------
    at
        The place as it was given.
    bounds
        Where the structure is [m].
    whose, word
        What is placed and what its place is called, for the errors.

    Raises
    ------
    ValueError
        If it lies outside the structure, or has one coordinate where three are needed.
    """
    where = read(at)
    if isinstance(where, Support):
        try:
            return where.on(bounds)
        except ValueError as error:
            raise InputError(f"{whose}: {error}") from error
    if _coordinates(where) != (3 if in_space(bounds) else 1):
        told = not_a_line(bounds) if in_space(bounds) else not_in_space(bounds)
        raise InputError(f"{whose}: {word} {_told(where)} was given, but {told}")
    _check_inside(where, bounds, f"{whose}: {word}")
    return where


def read(at: At) -> Position | Support:
    """Return three numbers or laws as a place, all else as it is.

    Raises
    ------
    ValueError
        If there are several coordinates, but not three.
    """
    if isinstance(at, Place | Support) or is_unknown(at):
        return at
    if not isinstance(at, tuple | list) and np.ndim(at) != 1:
        return at
    if len(at) != 3:
        raise InputError(
            f"A place of {len(at)} coordinates was given; one number on a line or three along x, y "
            "and z [m] in space are needed: at=(0.2, 0.0, 0.9)."
        )
    x, y, z = at
    return Cartesian(x, y, z)


def _coordinates(where: Any) -> int:
    if isinstance(where, AtNode):
        return int(np.prod(where.position.shape[1:], initial=1))
    if isinstance(where, Place):
        return 3
    return int(np.prod(where.shape() if is_unknown(where) else np.shape(where), initial=1))


def _check_inside(where: Any, bounds: Bounds, what: str) -> None:
    given = (where.x, where.y, where.z) if isinstance(where, Cartesian) else (where,)
    sides = zip(given, np.atleast_1d(bounds[0]), np.atleast_1d(bounds[1]), strict=False)
    if all(_may_be(one, low, high, hair(bounds)) for one, low, high in sides):
        return
    support = "Box" if in_space(bounds) else "Segment"
    raise InputError(
        f"{what} {_told(where)} m lies outside the structure ({words(bounds)}). Mode shapes are "
        f"only known on the structure; use supports.{support} within it."
    )


def _may_be(value: Any, low: float, high: float, rounding: float) -> bool:
    return not isinstance(value, int | float) or bool(low - rounding <= value <= high + rounding)


def _told(where: Any) -> str:
    """Write a place as it was given."""
    if isinstance(where, int | float):
        return said(where)
    if isinstance(where, Cartesian):
        return f"({_told(where.x)}, {_told(where.y)}, {_told(where.z)})"
    return type(where).__name__
