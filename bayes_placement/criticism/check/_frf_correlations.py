"""Correlations of measured with computed FRFs over the posterior: FRAC and FDAC."""

import numpy as np
import xarray as xr

from ...inference.output_residuals import Residuals
from .correlation import band, fdac, frac

MOST_LINES = 80
"""Most lines at which the frequency domain assurance criterion is computed, evenly spaced."""

MOST_DRAWS = 100


def correlations(data: Residuals) -> xr.Dataset:
    """FRAC of each channel pair and FDAC, each with median and 90 % band over the posterior.

    Logarithms of amplitudes are compared as amplitudes, without phase. FDAC is computed at no more
    than `MOST_LINES` lines.
    """
    stride = max(1, -(-data.draws.shape[0] // MOST_DRAWS))
    lines = np.unique(np.linspace(0, data.frequency.size - 1, MOST_LINES).astype(int))
    present = data.present[..., 0]
    measured = np.where(present, _frf(data, data.measured), 0)
    computed = np.where(present, _frf(data, data.draws[::stride]), 0)
    criteria = {
        "frac": (("sensor", "actuator"), band(frac, measured, computed)),
        "fdac": (
            ("measured_line", "computed_line"),
            band(fdac, measured[..., lines], computed[..., lines]),
        ),
    }
    variables = {
        f"{name}{ending}": (dimensions, values)
        for name, (dimensions, median_and_band) in criteria.items()
        for ending, values in zip(("", "_low", "_high"), median_and_band, strict=True)
    }
    labels: dict[str, object] = {s: data.template[s].values for s in ("sensor", "actuator")}
    for axis in ("measured_line", "computed_line"):
        labels[axis] = (axis, data.frequency[lines], {"units": "Hz"})
    return xr.Dataset(variables, coords=labels)


def _frf(data: Residuals, values: np.ndarray) -> np.ndarray:
    if values.shape[-1] == 2:
        return values[..., 0] + 1j * values[..., 1]
    logarithm = data.template.attrs.get("units", "").startswith("log10")
    return 10 ** values[..., 0] if logarithm else values[..., 0]
