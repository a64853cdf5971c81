"""Correlation of FRFs and of mode shapes: FRAC, FDAC and MAC.

Each is 1 for proportional vectors and 0 for orthogonal ones.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Inexact, Shaped

from ..._shared.errors import InputError

BAND = (0.05, 0.95)

FRFs = Inexact[np.ndarray, "*#draw sensor actuator frequency"]
ModeShapes = Inexact[np.ndarray, "*#draw channel mode"]
OtherShapes = Inexact[np.ndarray, "*#draw other_channel other_mode"]


def frac(measured: FRFs, computed: FRFs) -> Float[np.ndarray, "*#draw sensor actuator"]:
    """Frequency response assurance criterion of each channel pair.

    Heylen and Lammens, FRAC: a consistent way of comparing frequency response functions, 1996.

    FRFs [sensor, actuator, frequency] or amplitudes may have a leading axis of draws.
    """
    return _squared_cosine(measured, computed)


def fdac(measured: FRFs, computed: FRFs) -> Float[np.ndarray, "*#draw measured_line computed_line"]:
    """Frequency domain assurance criterion: operating deflection shapes at all pairs of lines.

    Pascual, Golinval and Razeto, A frequency domain correlation technique for model correlation
    and updating, IMAC 1997. A shift in frequency moves the largest entry of a row off the diagonal.

    FRFs [sensor, actuator, frequency] or amplitudes may have a leading axis of draws.
    """
    return _squared_cosines(
        *(frf.reshape(*frf.shape[:-3], -1, frf.shape[-1]) for frf in (measured, computed))
    )


def mac(first: ModeShapes, second: OtherShapes) -> Float[np.ndarray, "*#draw mode other_mode"]:
    """Modal assurance criterion of every mode of one set with every mode of another.

    Allemang and Brown, A correlation coefficient for modal vector analysis, IMAC 1982.

    Mode shapes [channel, mode] are at the same channels, in any scale; they may have a leading axis
    of draws.
    """
    _check_channels(first, second)
    return _squared_cosines(first, second)


def as_channels(shape: Float[np.ndarray, "mode place 3"]) -> Float[np.ndarray, "channel mode"]:
    """Return mode shapes at places as `mac` takes them, each direction a channel."""
    modes, places, axes = shape.shape
    return shape.transpose(1, 2, 0).reshape(places * axes, modes)


def band(
    criterion: Callable[..., np.ndarray],
    measured: Shaped[np.ndarray, "..."],
    draws: Shaped[np.ndarray, "draw ..."],
) -> Float[np.ndarray, "3 ..."]:
    """Median and 90 % band of `frac`, `fdac` or `mac` over draws from the posterior."""
    return np.quantile(criterion(measured, draws), [0.5, *BAND], axis=0)


def _squared_cosine(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Squared cosine along the last axis."""
    product = np.sum(first.conj() * second, axis=-1)
    return _normalised(product, _squares(first, -1) * _squares(second, -1))


def _squared_cosines(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Squared cosine of every column of the first with every column of the second."""
    squares = _squares(first, -2)[..., :, None] * _squares(second, -2)[..., None, :]
    return _normalised(first.conj().swapaxes(-1, -2) @ second, squares)


def _normalised(product: np.ndarray, squares: np.ndarray) -> np.ndarray:
    """Squared scalar product over the squared norms; zero where a norm is zero."""
    squared = np.abs(product) ** 2
    return np.divide(squared, squares, out=np.zeros_like(squared), where=squares > 0)


def _squares(values: np.ndarray, axis: int) -> np.ndarray:
    return np.sum(np.abs(values) ** 2, axis=axis)


def _check_channels(first: np.ndarray, second: np.ndarray) -> None:
    if first.shape[-2] != second.shape[-2]:
        raise InputError(
            f"Mode shapes at {first.shape[-2]} and at {second.shape[-2]} channels were given; the "
            "same channels are needed, since shapes are compared channel by channel. Read both at "
            "the sensors: shapes[channels]."
        )
