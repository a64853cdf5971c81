"""The three FRFs of motion per force: their two names, their unit and what derives them."""

from typing import NamedTuple

from .._types import InputError


class Quantity(NamedTuple):
    """An FRF of motion per force.

    Parameters
    ----------
    frf
        Name of the FRF.
    motion
        Name of the motion.
    derivative
        How many times the displacement is derived by time: the power of i w, under exp(+i w t).
    rate
        What follows the unit of length in that of the motion.
    data_type
        Ordinate data type in dataset 58 of universal files.
    """

    frf: str
    motion: str
    derivative: int
    rate: str
    data_type: int

    @property
    def unit(self) -> str:
        """Unit in SI."""
        return f"(m{self.rate})/N" if self.rate else "m/N"

    @property
    def ascii_unit(self) -> str:
        """Unit in SI as files have it: `(m/s^2)/N`."""
        return in_ascii(self.unit)


QUANTITIES = (
    Quantity("receptance", "displacement", 0, "", 8),
    Quantity("mobility", "velocity", 1, "/s", 11),
    Quantity("accelerance", "acceleration", 2, "/s²", 12),
)


def quantity_of(word: str) -> Quantity:
    """Return the quantity of a word: that of the FRF or that of the motion.

    Raises
    ------
    InputError
        If it is neither.
    """
    for quantity in QUANTITIES:
        if word in (quantity.frf, quantity.motion):
            return quantity
    raise InputError(
        f"quantity={word!r} was given; an FRF of displacement, velocity or acceleration per "
        "force is needed: quantity='receptance', 'mobility' or 'accelerance'."
    )


def frf_name(word: str) -> str:
    """Return the name of the FRF: `mobility` for `velocity`, and for itself."""
    return quantity_of(word).frf


def motion_name(word: str) -> str:
    """Return the name of the motion: `velocity` for `mobility`, and for itself."""
    return quantity_of(word).motion


def in_ascii(unit: str) -> str:
    """Return a unit, or a part of it, as files have it: `/s^2` for `/s²`."""
    return unit.replace("²", "^2")
