"""How much noise a fitted model needs, where the noise is not known."""

import numpy as np
import xarray as xr

from ..._shared.sites import Role
from ...inference.output_residuals import Chosen, Residuals
from ..noise_needed import NoiseNeeded, over_scatter, relative_size

OF_COHERENCE = {"noise factor", "noise coherence"}
"""Owner and field of factors on what the coherence says."""


def noise_needed(data: Residuals, posterior: xr.DataTree) -> NoiseNeeded | None:
    """Noise that the model needs; None where it is known."""
    if data.deviation is not None:
        return None
    parts = None if data.measured.shape[-1] == 1 else -1
    scale = np.where(data.present, data.scale, 0.0) if parts else data.scale
    everywhere = np.ones(data.residual.shape[:3], dtype=bool)
    factors = [
        float(np.median(draws))
        for draws in posterior["posterior"].data_vars.values()
        if draws.attrs.get("role") == Role.OUTPUT_ERROR.value
        and f"{draws.attrs['owner']} {draws.attrs['field']}" in OF_COHERENCE
    ]
    return NoiseNeeded(
        relative_size(scale, data.measured, parts),
        *scatter_of(data, everywhere),
        over_coherence=factors[0] if factors else float("nan"),
    )


def scatter_of(data: Residuals, group: Chosen) -> tuple[float, float]:
    """Residuals of a group over the scatter of neighbouring lines, and its p-value."""
    present = data.present & group[..., None]
    scaled = np.where(present, data.residual / data.scale, 0.0)
    runs = [data.force_level == level for level in np.unique(data.force_level)]
    return over_scatter(
        *(np.concatenate([_rows(array[:, :, run]) for run in runs]) for array in (scaled, present))
    )


def _rows(array: np.ndarray) -> np.ndarray:
    """Array [sensor, actuator, frequency, part] as rows along frequency."""
    return np.moveaxis(array, 2, -1).reshape(-1, array.shape[2])
