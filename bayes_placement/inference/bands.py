"""Amplitude of outputs, and the band in which a model expects the data."""

from typing import Any

import numpy as np
import xarray as xr

from ..experiment.experiment import MEASURED, RESPONSE

BAND = (0.05, 0.95)
"""Quantiles between which the band lies."""


def amplitude(values: np.ndarray, part: int | None) -> np.ndarray:
    """Return log10 of the amplitude of complex outputs; real outputs as they are.

    Parameters
    ----------
    values
        Outputs.
    part
        Axis of the real and the imaginary part; None where the outputs have no parts.
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

    Parameters
    ----------
    result
        What `infer` or `simulate` returned.

    Returns
    -------
    xarray.Dataset
        By channel pair and line the `mean`, `low` and `high` of the draws of the posterior
        predictive (of the prior predictive without output error, where there is no posterior),
        and what was `measured`, if it was; of complex outputs as log10 of the amplitude.
    """
    if "posterior_predictive" in result.children:
        predicted = result["posterior_predictive"].to_dataset()
        draws = predicted[MEASURED if MEASURED in predicted else RESPONSE]
    else:
        draws = result["prior_predictive"].to_dataset()[RESPONSE]
    values = labelled_amplitude(draws)
    sample = ("chain", "draw")
    low, high = (values.quantile(share, sample).drop_vars("quantile") for share in BAND)
    arrays: dict[str, Any] = {"mean": values.mean(sample), "low": low, "high": high}
    if "observed_data" in result.children:
        arrays["measured"] = labelled_amplitude(result["observed_data"].to_dataset()[MEASURED])
    return xr.Dataset(arrays).assign_attrs(units=values.attrs["units"])
