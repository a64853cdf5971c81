"""Measured and predicted outputs of a result as arrays, and the residuals between them."""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Bool, Float, Int
from numpyro.distributions import Distribution, MaskedDistribution, MultivariateNormal

from .._shared.errors import InputError
from .._shared.labels import FORCE_LEVEL
from ..experiment.experiment import MEASURED, RESPONSE, Experiment
from ..experiment.noise import Data
from ..experiment.observe import Complex
from ..experiment.observed_modes import COLUMN
from .estimates import scalars
from .results import RESPONSE_WHEN_EXACT, observed_of

FRFParts = Float[np.ndarray, "sensor actuator frequency part"]
Draws = Float[np.ndarray, "draw sensor actuator frequency part"]
Chosen = Bool[np.ndarray, "sensor actuator frequency"]
Labelled = TypeVar("Labelled", xr.DataArray, xr.Dataset)


@dataclass(frozen=True)
class Residuals:
    """Measured outputs and those of the model.

    The lines of all force levels are concatenated, sorted within each level, so that every
    statistic runs along one axis; `labelled` separates them again.
    """

    template: xr.DataArray
    """Measured outputs with their labels."""
    measured: FRFParts
    """Measured outputs; zero where nothing was measured."""
    present: Bool[np.ndarray, "sensor actuator frequency part"]
    """Where something was measured."""
    draws: Draws
    """Outputs of the model at draws from the posterior."""
    replicates: Draws | None
    """The same with an output error drawn for each; None where the model has no output error."""
    deviation: FRFParts | None
    """Standard deviation of the noise of each output; None where the noise is not known."""
    scatter: FRFParts | None
    """The same by neighbouring lines of the whole record; None where they tell none, or it is."""
    frequency: Float[np.ndarray, "frequency"]
    """Lines [Hz]."""
    force_level: Int[np.ndarray, "frequency"]
    """Number of the force level of each line; zero where there is a single level."""
    unknowns: int
    """Number of unknowns that were fitted."""

    @property
    def is_modal(self) -> bool:
        """Whether lines are modes, of which none is the neighbour of another."""
        return shows_modes(self.template)

    @cached_property
    def mean(self) -> FRFParts:
        """Posterior mean of the response."""
        return self.draws.mean(axis=0)

    @cached_property
    def residual(self) -> FRFParts:
        """Measured outputs less the posterior mean response; zero where nothing was measured."""
        return np.where(self.present, self.measured - self.mean, 0.0)

    @cached_property
    def scale(self) -> FRFParts:
        """Deviation of the noise where known, else of the replicates, else of the residuals."""
        if self.deviation is not None:
            return self.deviation
        if self.replicates is not None:
            return np.sqrt(np.mean((self.replicates - self.draws) ** 2, axis=0))
        axes = (2, 3)
        count = np.maximum(self.present.sum(axes, keepdims=True), 1)
        size = np.sqrt(np.sum(self.residual**2, axes, keepdims=True) / count)
        return np.broadcast_to(np.where(size > 0, size, 1.0), self.residual.shape)

    def labelled(self, values: np.ndarray, **attributes: str) -> xr.DataArray:
        """Put the labels of the outputs on an array; NaN where nothing was measured."""
        array = np.where(self.present, values, np.nan)
        flat = self.template.copy(data=array if "part" in self.template.dims else array[..., 0])
        return by_level(flat.assign_attrs(attributes))

    def labelled_lines(self, values: np.ndarray, **attributes: str) -> xr.DataArray:
        """Put the labels on one number for each line, both parts together."""
        template = self.template
        flat = template.isel(part=0, drop=True) if "part" in template.dims else template
        array = np.where(self.present[..., 0], values, np.nan)
        return by_level(flat.copy(data=array).assign_attrs(attributes))


def shows_modes(labelled: xr.DataArray | xr.Dataset) -> bool:
    """Whether outputs are modal parameters, by their labels."""
    return labelled["actuator"].values.tolist() == [COLUMN]


def output_residuals(posterior: xr.DataTree) -> Residuals:
    """Read measured and predicted outputs from what `infer` returned."""
    observed = _in_order(observed_of(posterior))
    predicted = _in_order(posterior["posterior_predictive"].to_dataset())
    template = _transposed(observed[MEASURED], ())
    raw = _with_part(template)
    draws = _flat_draws(predicted[RESPONSE])
    if draws.shape[0] < 2:
        raise InputError(
            "The posterior holds one draw of the response; at least two are needed, since the "
            "expected misfit follows from their spread. Draw more: engines.SMC(particles=1000)."
        )
    return Residuals(
        template=template,
        measured=np.where(np.isfinite(raw), raw, 0.0),
        present=np.isfinite(raw),
        draws=draws,
        replicates=_flat_draws(predicted[MEASURED]) if MEASURED in predicted else None,
        deviation=_of_outputs(observed, "deviation"),
        scatter=_of_outputs(observed, "scatter"),
        frequency=np.asarray(template["frequency"].values, dtype=float),
        force_level=levels_of(template)[1],
        unknowns=sum(len(scalars("", v.values)) for v in posterior["posterior"].data_vars.values()),
    )


def response_when_exact(posterior: xr.DataTree) -> FRFParts | None:
    """Mean response without the errors of the model; None where it has none."""
    predicted = posterior["posterior_predictive"].to_dataset()
    if RESPONSE_WHEN_EXACT not in predicted:
        return None
    ordered = _in_order(predicted)
    return _flat_draws(ordered[RESPONSE_WHEN_EXACT]).mean(axis=0)


def by_level(flat: Labelled) -> Labelled:
    """Separate concatenated force levels along a dimension of their own."""
    levels, number = levels_of(flat)
    if not levels.size:
        return flat
    runs = [
        flat.isel(frequency=np.flatnonzero(number == level)).drop_vars(FORCE_LEVEL)
        for level in range(levels.size)
    ]
    levelled = xr.concat(runs, FORCE_LEVEL, coords="minimal", compat="override", join="override")
    ordered = levelled.transpose("sensor", "actuator", FORCE_LEVEL, "frequency", ...)
    return ordered.assign_coords({FORCE_LEVEL: (FORCE_LEVEL, levels, {"units": "N"})})


def _in_order(dataset: xr.Dataset) -> xr.Dataset:
    """Sort the lines and concatenate those of all force levels."""
    ordered = dataset.sortby("frequency")
    if FORCE_LEVEL not in ordered.dims:
        return ordered
    lines = (FORCE_LEVEL, "frequency")
    flat = ordered.sortby(FORCE_LEVEL).stack(line=lines, create_index=False)
    return flat.swap_dims(line="frequency")


def levels_of(labelled: xr.DataArray | xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Force levels [N], none where they are not known, and the number of the level of each line."""
    if FORCE_LEVEL not in labelled.coords:
        return np.empty(0), np.zeros(labelled.sizes["frequency"], int)
    levels, number = np.unique(labelled[FORCE_LEVEL].values, return_inverse=True)
    return levels, number


def _transposed(values: xr.DataArray, leading: tuple[str, ...]) -> xr.DataArray:
    trailing = ("part",) if "part" in values.dims else ()
    return values.transpose(*leading, "sensor", "actuator", "frequency", *trailing)


def _with_part(values: xr.DataArray) -> Float[np.ndarray, "..."]:
    array = np.asarray(values.values, dtype=float)
    return array if "part" in values.dims else array[..., None]


def _flat_draws(values: xr.DataArray) -> Draws:
    array = _with_part(_transposed(values, ("chain", "draw")))
    return array.reshape(-1, *array.shape[2:])


def _of_outputs(observed: xr.Dataset, name: str) -> FRFParts | None:
    if name not in observed:
        return None
    deviation = _with_part(_transposed(observed[name], ()))
    return np.where(np.isfinite(deviation), deviation, 1.0)


Logarithmic = bool | Bool[Array, ""]

LOGARITHMIC_ERROR = 0.1
"""Relative error by which a logarithmic residual is divided."""

LEAST_RATIO = 1e-12
"""Least modulus of what is predicted over what was measured, whose logarithm is taken."""


def standardised_residual(
    known: Experiment, data: Data, logarithmic: Logarithmic
) -> tuple[Array, Array]:
    """Residuals over their standard deviations, and the sum of the logs of these.

    Nothing of the experiment is unknown. They may be those of the complex logarithm, which only
    complex FRFs have.
    """
    assert known.noise is not None
    frf = known.frf() if isinstance(known.observe, Complex) else None
    predicted = known.predict() if frf is None else known.observe.output(frf)
    distribution = known.noise.distribution(predicted, data)
    plain, log_scale = _standardised(distribution, data)
    if frf is None:
        return plain, log_scale
    # A logarithm and an angle take longer than the FRF: they are computed where they are asked for.
    chosen = jax.lax.cond(logarithmic, lambda: _logarithmic(frf, data), lambda: plain)
    return chosen, log_scale


def _standardised(distribution: Distribution, data: Data) -> tuple[Array, Array]:
    """Residuals over their standard deviations and the sum of the logs of these.

    Zero where nothing was measured.
    """
    base = distribution.base_dist if isinstance(distribution, MaskedDistribution) else distribution
    error = data.z - base.mean
    if isinstance(base, MultivariateNormal):
        # One factor serves all channels and parts: its logarithm counts for each of them.
        scale = jnp.broadcast_to(base.scale_tril, (*error.shape, error.shape[-1]))
        plain = jax.scipy.linalg.solve_triangular(scale, error[..., None], lower=True)[..., 0]
        return plain.ravel(), jnp.sum(jnp.log(jnp.diagonal(scale, axis1=-2, axis2=-1)))
    deviation = jnp.broadcast_to(base.scale, error.shape)
    logs = jnp.sum(jnp.where(data.measured, jnp.log(deviation), 0.0))
    return jnp.where(data.measured, error / deviation, 0.0).ravel(), logs


def _logarithmic(frf: Array, data: Data) -> Array:
    """Residual of the complex logarithm, the phase wrapped to its principal value.

    In real numbers: complex division and modulus guard against overflow, and take three times as
    long.
    """
    real, imaginary = jnp.real(frf), jnp.imag(frf)
    of_data = data.z[..., 0, :], data.z[..., 1, :]
    over_square = 1 / (of_data[0] ** 2 + of_data[1] ** 2)
    along = (real * of_data[0] + imaginary * of_data[1]) * over_square
    across = (imaginary * of_data[0] - real * of_data[1]) * over_square
    square = along**2 + across**2
    is_known = square > LEAST_RATIO**2  # not where nothing is predicted, or NaN
    log_ratio = 0.5 * jnp.log(jnp.where(is_known, square, LEAST_RATIO**2))
    angle = jnp.where(is_known, jnp.arctan2(across, along), 0.0)
    measured = data.measured
    parts = jnp.where(measured, jnp.stack([log_ratio, angle], axis=-2), 0.0)
    return parts.ravel() / LOGARITHMIC_ERROR
