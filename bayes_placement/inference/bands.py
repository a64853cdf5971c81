"""Outputs by amplitude and phase, and the band in which a model expects the data."""

import numpy as np
import xarray as xr

from ..experiment.experiment import MEASURED, RESPONSE

BAND = (0.05, 0.95)
"""Quantiles between which the band lies."""

SAMPLE = ("chain", "draw")
"""Dimensions of draws."""


def amplitude(values: np.ndarray, part: int | None) -> np.ndarray:
    """Return log10 of the amplitude of complex outputs; real outputs as they are.

    The part is the axis of real and imaginary part; None where outputs have none.
    """
    if part is None:
        return values
    if values.shape[part] == 1:
        return values.take(0, axis=part)
    with np.errstate(divide="ignore"):  # nothing was measured there
        return np.asarray(np.log10(np.sum(values**2, axis=part)) / 2)


def labelled_amplitude(values: xr.DataArray) -> xr.DataArray:
    """Return log10 of the amplitude of complex outputs; real outputs as they are."""
    if "part" not in values.dims:
        return values
    logarithm: xr.DataArray = xr.apply_ufunc(
        amplitude, values, input_core_dims=[["part"]], kwargs={"part": -1}
    )
    return logarithm.assign_attrs(units=f"log10 of {values.attrs['units']}")


def predictive_band(result: xr.DataTree) -> xr.Dataset:
    """Return the 90 % band of the outputs that a posterior or a prior predicts.

    By channel pair and line `mean`, `low` and `high` of the draws of the posterior predictive (of
    the prior predictive without output error, where there is no posterior), and what was
    `measured`, if it was; of complex outputs as log10 of the amplitude.
    """
    values, measured = labelled_amplitude(_draws(result)), _measured(result)
    shown = None if measured is None else labelled_amplitude(measured)
    return _band(values.mean(SAMPLE), values, shown, values.attrs["units"])


def phase_band(result: xr.DataTree) -> xr.Dataset | None:
    """Return the 90 % band of the phase [degrees]; None where outputs are not complex.

    The `mean` is the direction of the mean of draws of unit length, and `low` and `high` lie within
    half a turn of it.
    """
    draws, measured = _draws(result), _measured(result)
    if draws.sizes.get("part", 1) < 2:
        return None
    turned = _unit_phasor(draws)
    middle = turned.mean(SAMPLE)
    mean, around = _degrees(middle), _degrees(turned * np.conj(middle))
    shown = None if measured is None else _degrees(_unit_phasor(measured))
    return _band(mean, mean + around, shown, "phase [°]")


def _band(
    mean: xr.DataArray, draws: xr.DataArray, measured: xr.DataArray | None, units: str
) -> xr.Dataset:
    """Mean and quantiles of draws, and what was measured, if it was."""
    low, high = (draws.quantile(share, SAMPLE).drop_vars("quantile") for share in BAND)
    arrays = {"mean": mean, "low": low, "high": high}
    if measured is not None:
        arrays["measured"] = measured
    return xr.Dataset(arrays).assign_attrs(units=units)


def _draws(result: xr.DataTree) -> xr.DataArray:
    """Draws of outputs, those of the posterior predictive where there is one."""
    if "posterior_predictive" not in result.children:
        return result["prior_predictive"].to_dataset()[RESPONSE]
    predicted = result["posterior_predictive"].to_dataset()
    return predicted[MEASURED if MEASURED in predicted else RESPONSE]


def _measured(result: xr.DataTree) -> xr.DataArray | None:
    if "observed_data" not in result.children:
        return None
    return result["observed_data"].to_dataset()[MEASURED]


def _unit_phasor(values: xr.DataArray) -> xr.DataArray:
    """Complex numbers of unit size, from a real and an imaginary part."""
    phasor = values.isel(part=0, drop=True) + 1j * values.isel(part=1, drop=True)
    return phasor / np.abs(phasor)


def _degrees(phasor: xr.DataArray) -> xr.DataArray:
    return xr.apply_ufunc(lambda values: np.angle(values, deg=True), phasor)
