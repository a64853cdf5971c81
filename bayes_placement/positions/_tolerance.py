"""Tolerance: the region in which the true position of a transducer or effect may lie."""

import abc

import equinox as eqx
import numpy as np

from .._shared.errors import InputError
from .._shared.reprs import with_short_repr
from .bounds import Bounds, bounds_text
from .places import Position
from .vectors import Recorded


@with_short_repr
class Tolerance(eqx.Module):
    """Region in which something may sit; a structure makes a distribution of it.

    Examples
    --------
    >>> isinstance(bp.positions.Segment(0.2, within=0.02), bp.positions.Tolerance)
    True
    """

    @property
    @abc.abstractmethod
    def recorded(self) -> Recorded:
        """Recorded position [m]."""

    @abc.abstractmethod
    def on(self, bounds: Bounds) -> Position:
        """Uniform distribution of the position [m], clipped to the structure.

        Raises
        ------
        InputError
            If no part of the region lies on the structure, or it is larger than the structure.
        """

    @abc.abstractmethod
    def around(self, centre: object) -> "Tolerance":
        """Return the same tolerance about another recorded position [m]."""

    @abc.abstractmethod
    def scaled(self, factor: float) -> "Tolerance":
        """Return a tolerance `factor` times as large about the same position.

        Raises
        ------
        InputError
            If it has no size to scale.
        """


def check_reach(tolerance: Tolerance, reach: float, bounds: Bounds) -> None:
    """Refuse a tolerance that says nothing of the position, as millimetres taken for metres do."""
    size = float(np.max(np.subtract(bounds[1], bounds[0])))
    if reach > size:
        raise InputError(
            f"{tolerance} reaches {reach:g} m to either side, farther than the structure "
            f"({bounds_text(bounds)}) is long; a tolerance in metres is needed: {reach / 1000:g} "
            f"for {reach:g} mm. Where nothing is known of the position, {size:g} is enough."
        )


def off_structure(tolerance: Tolerance, bounds: Bounds) -> str:
    """Say that no part of a tolerance lies on the structure."""
    return (
        f"{tolerance} has no point on the structure ({bounds_text(bounds)}). A position on it is "
        "needed, in metres and in its axes."
    )
