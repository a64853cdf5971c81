"""Correlation of FRFs and of mode shapes: FRAC, FDAC, MAC and CoMAC.

Each is 1 where two shapes are proportional and 0 where they are orthogonal.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float, Inexact, Shaped

from ..._types import InputError
from ._residuals import Residuals, band_of

MOST_LINES = 80
"""Lines that the frequency domain assurance criterion is computed for, spread over all."""

MOST_DRAWS = 100

FRFs = Inexact[np.ndarray, "*#draw sensor actuator frequency"]
ModeShapes = Inexact[np.ndarray, "*#draw channel mode"]
OtherShapes = Inexact[np.ndarray, "*#draw other_channel other_mode"]


def frac(measured: FRFs, computed: FRFs) -> Float[np.ndarray, "*#draw sensor actuator"]:
    """Frequency response assurance criterion of each channel pair.

    Heylen and Lammens, FRAC: a consistent way of comparing frequency response functions, 1996.

    Parameters
    ----------
    measured, computed
        FRFs [sensor, actuator, frequency], or amplitudes; draws may lead.
    """
    return _alike(measured, computed)


def fdac(measured: FRFs, computed: FRFs) -> Float[np.ndarray, "*#draw measured_line computed_line"]:
    """Frequency domain assurance criterion: the operating shapes at all pairs of lines.

    Pascual, Golinval and Razeto, A frequency domain correlation technique for model correlation
    and updating, IMAC 1997. The largest entry of a row off the diagonal tells of a shift in
    frequency.

    Parameters
    ----------
    measured, computed
        FRFs [sensor, actuator, frequency], or amplitudes; draws may lead.
    """
    return _crossed(*(x.reshape(*x.shape[:-3], -1, x.shape[-1]) for x in (measured, computed)))


def mac(first: ModeShapes, second: OtherShapes) -> Float[np.ndarray, "*#draw mode other_mode"]:
    """Modal assurance criterion of every mode of one set with every mode of another.

    Allemang and Brown, A correlation coefficient for modal vector analysis, IMAC 1982.

    Parameters
    ----------
    first, second
        Mode shapes [channel, mode] at the same channels, in any scale; draws may lead.
    """
    _check_channels(first, second)
    return _crossed(first, second)


def comac(first: ModeShapes, second: OtherShapes) -> Float[np.ndarray, "*#draw channel"]:
    """Coordinate modal assurance criterion of each channel over paired modes.

    Lieven and Ewins, Spatial correlation of mode shapes, IMAC 1988. Shapes are scaled to unit
    length first, and only amplitudes count, as in the paper.

    Parameters
    ----------
    first, second
        Mode shapes [channel, mode] at the same channels and in the same order of modes, in any
        scale; draws may lead.
    """
    _check_channels(first, second)
    if first.shape[-1] != second.shape[-1]:
        raise InputError(
            f"CoMAC was given {first.shape[-1]} and {second.shape[-1]} modes; it needs them "
            "paired, since it compares channel by channel over pairs. Pair them by their MAC: "
            "second[:, mac(first, second).argmax(1)]."
        )
    one, other = (np.abs(shapes) / _lengths(shapes) for shapes in (first, second))
    return _alike(one, other)


def band(
    criterion: Callable[..., np.ndarray],
    measured: Shaped[np.ndarray, "..."],
    draws: Shaped[np.ndarray, "draw ..."],
) -> Float[np.ndarray, "3 ..."]:
    """Median and 90 % band of a criterion over draws from the posterior.

    Parameters
    ----------
    criterion
        `frac`, `fdac`, `mac` or `comac`.
    measured
        What was measured.
    draws
        What was computed, draw by draw.
    """
    return np.stack(band_of(criterion(measured, draws)))


def correlations(data: Residuals) -> xr.Dataset:
    """FRAC of each channel pair and FDAC, each with median and 90 % band over the posterior.

    Logarithms of amplitudes are compared as amplitudes, without phase. The lines of FDAC are at
    most `MOST_LINES` of all.
    """
    stride = max(1, -(-data.draws.shape[0] // MOST_DRAWS))
    lines = np.unique(np.linspace(0, data.frequency.size - 1, MOST_LINES).astype(int))
    present = data.present[..., 0]
    measured = np.where(present, _frf(data, data.measured), 0)
    computed = np.where(present, _frf(data, data.draws[::stride]), 0)
    rows = {
        "frac": (("sensor", "actuator"), band(frac, measured, computed)),
        "fdac": (
            ("measured_line", "computed_line"),
            band(fdac, measured[..., lines], computed[..., lines]),
        ),
    }
    variables = {
        f"{name}{ending}": (dimensions, values)
        for name, (dimensions, three) in rows.items()
        for ending, values in zip(("", "_low", "_high"), three, strict=True)
    }
    places: dict[str, Any] = {s: data.template[s].values for s in ("sensor", "actuator")}
    for side in ("measured_line", "computed_line"):
        places[side] = (side, data.frequency[lines], {"units": "Hz"})
    return xr.Dataset(variables, coords=places)


def _frf(data: Residuals, values: np.ndarray) -> np.ndarray:
    if values.shape[-1] == 2:
        return values[..., 0] + 1j * values[..., 1]
    logarithm = data.template.attrs.get("units", "").startswith("log10")
    return 10 ** values[..., 0] if logarithm else values[..., 0]


def _alike(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Squared cosine along the last axis."""
    return _over(np.sum(first.conj() * second, axis=-1), _squares(first, -1) * _squares(second, -1))


def _crossed(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Squared cosine of every column of one with every column of the other."""
    sizes = _squares(first, -2)[..., :, None] * _squares(second, -2)[..., None, :]
    return _over(first.conj().swapaxes(-1, -2) @ second, sizes)


def _over(product: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Square of a product over the squares of its factors; zero where one of them vanishes."""
    squared = np.abs(product) ** 2
    return np.divide(squared, sizes, out=np.zeros_like(squared), where=sizes > 0)


def _squares(values: np.ndarray, axis: int) -> np.ndarray:
    return np.sum(np.abs(values) ** 2, axis=axis)


def _lengths(shapes: np.ndarray) -> np.ndarray:
    return np.sqrt(np.sum(np.abs(shapes) ** 2, axis=-2, keepdims=True))


def _check_channels(first: np.ndarray, second: np.ndarray) -> None:
    if first.shape[-2] != second.shape[-2]:
        raise InputError(
            f"Mode shapes at {first.shape[-2]} and at {second.shape[-2]} channels were given; the "
            "same channels are needed, since shapes are compared place by place. Read both at the "
            "sensors: shapes[channels]."
        )
