"""The three FRFs of motion per force: names, units, and the conversion between them."""

from typing import NamedTuple

import numpy as np

from .._shared.errors import InputError


class Quantity(NamedTuple):
    """An FRF of motion per force."""

    frf: str
    """Name of the FRF."""
    motion: str
    """Name of the motion."""
    derivative: int
    """Order of the time derivative of the displacement: the power of i w, under exp(+i w t)."""
    rate: str
    """Unit of the motion after that of length, such as `/s`."""
    data_type: int
    """Ordinate data type in dataset 58 of universal files."""

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
    """Return the quantity of a word: that of the FRF or that of the motion."""
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


def converted(frf: np.ndarray, frequency: np.ndarray, source: str, target: str) -> np.ndarray:
    """Turn FRFs of one quantity into another by powers of i w, under exp(+i w t).

    Their last axis is the frequency [Hz].
    """
    power = quantity_of(target).derivative - quantity_of(source).derivative
    if power < 0 and np.any(frequency == 0):
        raise InputError(
            f"The {source} at 0 Hz was given; a {target} there would need a division by zero, "
            "since the derivatives of a constant displacement vanish. Drop 0 Hz: "
            "measurement.without(0, 0)."
        )
    return frf * (2j * np.pi * frequency) ** power


def in_ascii(unit: str) -> str:
    """Return a unit, or a part of it, as files have it: `/s^2` for `/s²`."""
    return unit.replace("²", "^2")
