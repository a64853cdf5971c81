"""Chi2, whiteness and predictive p-values of any group of residuals."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.special import ndtr

from ..._shared.sites import Role
from ...inference.chi2 import Chi2
from ...inference.output_residuals import Chosen, FRFParts, Residuals
from ..noise_needed import NoiseNeeded, is_misfit_alike, over_noise, over_scatter, relative_size
from .correlation import band, fdac, frac

OF_COHERENCE = {"noise factor", "noise coherence"}
"""Owner and field of factors on what the coherence says."""


def noise_needed(data: Residuals, posterior: xr.DataTree) -> NoiseNeeded | None:
    """Noise that the model needs; None where it is known."""
    if data.deviation is not None:
        return None
    parts = None if data.measured.shape[-1] == 1 else -1
    scale = np.where(data.present, data.scale, 0.0) if parts else data.scale
    everywhere = np.ones(data.residual.shape[:3], dtype=bool)
    scatter = _scatter_over_noise(data)
    beyond = over_noise(data.residual / data.scale, data.present)
    factors = [
        beyond * float(np.median(draws))
        for draws in posterior["posterior"].data_vars.values()
        if draws.attrs.get("role") == Role.OUTPUT_ERROR.value
        and f"{draws.attrs['owner']} {draws.attrs['field']}" in OF_COHERENCE
    ]
    return NoiseNeeded(
        relative_size(beyond * scale, data.measured, parts),
        *scatter_of(data, everywhere),
        over_coherence=factors[0] if factors else float("nan"),
        is_misfit_alike=is_misfit_alike(
            _rows_of_runs(data, data.measured / data.scale) / beyond,
            _rows_of_runs(data, data.present),
            None if scatter is None else scatter / beyond,
        ),
    )


def scatter_of(data: Residuals, group: Chosen) -> tuple[float, float]:
    """Residuals of a group over the scatter of neighbouring lines, and its p-value."""
    present = data.present & group[..., None]
    scaled = np.where(present, data.residual / data.scale, 0.0)
    residual, known = (_rows_of_runs(data, array) for array in (scaled, present))
    return over_scatter(residual, known, _scatter_over_noise(data))


def _scatter_over_noise(data: Residuals) -> np.ndarray | None:
    """Scatter of lines of the whole record over the deviation of the noise, as rows."""
    return None if data.scatter is None else _rows_of_runs(data, data.scatter / data.scale)


def _rows_of_runs(data: Residuals, array: np.ndarray) -> np.ndarray:
    """Array [sensor, actuator, frequency, part] as rows along frequency, a row for each run."""
    runs = [data.force_level == level for level in np.unique(data.force_level)]
    return np.concatenate([_rows(array[:, :, run]) for run in runs])


def _rows(array: np.ndarray) -> np.ndarray:
    """Array [sensor, actuator, frequency, part] as rows along frequency."""
    return np.moveaxis(array, 2, -1).reshape(-1, array.shape[2])


LAGS = 5
"""Largest distance in lines over which residuals are compared."""

FEWEST_PAIRS = 16
"""Fewest pairs of lines for which whiteness is tested."""

_LARGEST = 3.0
"""Deviations at which residuals are clipped, so that a few peaks do not decide on whiteness."""

Pairs = Float[np.ndarray, "lag sensor actuator frequency part"]


@dataclass(frozen=True)
class Statistics:
    """Statistics of any group of residuals; intermediate arrays of all groups are computed once."""

    data: Residuals

    def of(self, group: Chosen) -> dict[str, float]:
        """All statistics of one group."""
        p_values = {"whiteness": self.whiteness(group), "predictive": self.predictive(group)}
        count = float(np.sum(self.data.present[..., 0] & group))
        return {"data": count} | self.chi2(group) | p_values | self.scatter(group)

    def chi2(self, group: Chosen) -> dict[str, float]:
        """Chi2 per datum with its distribution for a correct model, see `Chi2`."""
        return self._chi2.of(group)

    def scatter(self, group: Chosen) -> dict[str, float]:
        """Residuals over the scatter of neighbouring lines, where the noise is not known."""
        known = self.data.deviation is not None
        ratio, p_value = (float("nan"),) * 2 if known else scatter_of(self.data, group)
        return {"over_scatter": ratio, "p_scatter": p_value}

    def whiteness(self, group: Chosen) -> float:
        """p-value of the hypothesis that residuals of neighbouring lines are uncorrelated.

        The variance ratio test for noise of any variance along the lines (Lo and MacKinlay, 1988,
        doi:10.1093/rfs/1.1.41), one-sided: an effect that the model lacks makes neighbours
        positively correlated. Modes have no neighbours.
        """
        products, squares = (np.sum(pairs[:, group], axis=(1, 2)) for pairs in self._lagged)
        if self.data.is_modal or np.sum(self._lagged[1][0, group] > 0) < FEWEST_PAIRS:
            return float("nan")
        weight = 1 - np.arange(1, products.size + 1) / (products.size + 1)
        return float(ndtr(-weight @ products / np.sqrt(weight**2 @ squares)))

    def predictive(self, group: Chosen) -> float:
        """Posterior predictive p-value: share of draws whose replicate has a larger chi2 than data.

        Both chi2 are taken about the response of the same draw (Gelman, Meng and Stern, 1996).
        """
        if self.data.replicates is None:
            return float("nan")
        return float(np.mean(np.sum(self._excess[:, group], axis=1) >= 0))

    @cached_property
    def _chi2(self) -> Chi2:
        return Chi2(self.data)

    @cached_property
    def _excess(self) -> Float[np.ndarray, "draw sensor actuator frequency"]:
        """Chi2 of the replicate less chi2 of the data, both about the response of each draw."""
        data = self.data
        weight = np.where(data.present, data.scale**-2.0, 0.0)
        replicated, observed = data.replicates - data.draws, data.measured - data.draws
        return np.sum(weight * (replicated**2 - observed**2), axis=-1)

    @cached_property
    def _lagged(self) -> tuple[Pairs, Pairs]:
        """Products of residuals at each lag, corrected for the fit, and their squares."""
        lags = range(1, min(LAGS, self.data.frequency.size - 1) + 1)
        pairs = [self._pairs(lag) for lag in lags] or [(np.zeros_like(self.data.residual),) * 2]
        products, squares = zip(*pairs, strict=True)
        return np.stack(products), np.stack(squares)

    def _pairs(self, lag: int) -> tuple[FRFParts, FRFParts]:
        data, scale = self.data, self.data.scale
        scaled = np.clip(data.residual / scale, -_LARGEST, _LARGEST)
        same_level = data.force_level[lag:] == data.force_level[:-lag]
        mask = data.present[:, :, lag:] & data.present[:, :, :-lag] & same_level[:, None]
        product = np.where(mask, scaled[:, :, lag:] * scaled[:, :, :-lag], 0.0)
        # A fit reduces the covariance of the residuals by that of the response.
        deviation = data.draws - data.mean
        covariance = np.mean(deviation[:, :, :, lag:] * deviation[:, :, :, :-lag], axis=0)
        covariance = np.where(mask, covariance / (scale[:, :, lag:] * scale[:, :, :-lag]), 0.0)
        fill = [(0, 0), (0, 0), (0, lag), (0, 0)]
        return np.pad(product + covariance, fill), np.pad(product**2, fill)


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
