"""Smooth part of the residual of a fitted model, with a band.

A Gaussian process over frequency (Kennedy and O'Hagan, 2001, doi:10.1111/1467-9868.00294), fitted
to the residual of a finished fit: it shows where the model is wrong and changes no parameter.
"""

from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Bool, Float
from scipy.special import ndtri
from tinygp import GaussianProcess
from tinygp.kernels import quasisep

from ..._shared.compiled import compiled
from ..._shared.labels import FORCE_LEVEL
from ...inference.output_residuals import Residuals
from ._residuals import residuals

AMPLITUDES, LENGTHS = 24, 16
FEWEST_LINES = 5
"""Lines from which on unknown noise is told from a smooth part, which fits fewer by itself."""

_VARIANCE_NOT_MEASURED = 1e12
_ZERO_AMPLITUDE = 1e-6
_SIGNIFICANT = float(-ndtri(0.025))


Values: TypeAlias = Array | np.ndarray
One = Float[Array, ""]
Lines = Float[Array, "frequency"]
Parts = Float[Array, "frequency part"]
Mask = Bool[Array, "frequency"]


class _Fit(NamedTuple):
    """Discrepancy in noise deviations [channel, frequency, part]; its parameters [channel]."""

    mean: Values
    deviation: Values
    amplitude: Values
    length: Values
    noise: Values
    log_ratio: Values


def discrepancy(posterior: xr.DataTree) -> xr.Dataset:
    """Smooth part of the residual of each channel pair.

    The residual at the posterior mean response is modelled as a Gaussian process of Matern's kernel
    3/2 plus the noise, both in units of the noise deviation of each line, so that the process has
    the same amplitude at resonances and between them. Real and imaginary part are independent and
    share amplitude and length scale. These two maximise the marginal likelihood on a grid; an
    unknown noise level is maximised in closed form.

    Of each line, in the unit of the outputs, come `mean` and the 95 % band `low` to `high`, and
    `significant`, whether the band excludes zero. By channel pair (and `force_level` [N]):
    `amplitude` [noise deviations], `length` [Hz], `noise` (factor on the noise deviation), the
    `log_ratio` of the likelihood to that without discrepancy, and the `share` of lines where the
    discrepancy is significant (of a correct model, at most 5 % on average).
    """
    return of(residuals(posterior))


def of(data: Residuals) -> xr.Dataset:
    """Discrepancy of residuals."""
    levels = np.unique(data.force_level)
    fits = [_fitted(data, np.flatnonzero(data.force_level == level)) for level in levels]
    relative = [np.concatenate([fit[i] for fit in fits], axis=2) for i in range(2)]
    mean, deviation = (np.where(data.present, x * data.scale, np.nan) for x in relative)
    margin = _SIGNIFICANT * deviation
    significant = np.any(np.abs(mean) > margin, axis=-1)
    unit = {"units": data.template.attrs.get("units", "")}
    lines = {"mean": mean, "low": mean - margin, "high": mean + margin}
    dataset = xr.Dataset({name: data.labelled(x, **unit) for name, x in lines.items()})
    if data.is_modal:  # modes have no neighbours between which anything were smooth
        dataset = dataset.where(False)
    fewest = min(np.sum(data.force_level == level) for level in levels)
    if data.is_modal or (data.deviation is None and fewest < FEWEST_LINES):
        significant = np.zeros_like(significant)
    dataset["significant"] = data.labelled_lines(significant) > 0
    present = data.present[..., 0]
    shares = [_share(significant, present & (data.force_level == level)) for level in levels]
    columns = {name: [getattr(fit, name) for fit in fits] for name in _Fit._fields[2:]}
    return _by_channel(columns | {"share": shares}, dataset)


def _by_channel(columns: dict[str, list[np.ndarray]], dataset: xr.Dataset) -> xr.Dataset:
    """Add numbers of each channel pair, and of each force level where there are several."""
    pair = ("sensor", "actuator")
    if FORCE_LEVEL not in dataset.dims:
        return dataset.assign({name: (pair, values[0]) for name, values in columns.items()})
    stacked = {name: ((FORCE_LEVEL, *pair), np.stack(values)) for name, values in columns.items()}
    return dataset.assign(stacked)


def _share(significant: np.ndarray, present: np.ndarray) -> np.ndarray:
    return np.sum(significant & present, axis=-1) / np.maximum(present.sum(axis=-1), 1)


def _fitted(data: Residuals, lines: np.ndarray) -> _Fit:
    """Fit every channel pair at one force level."""
    shape = data.residual.shape[:2]
    noise_known = data.deviation is not None
    values = (data.residual / data.scale)[:, :, lines]
    amplitudes = _amplitudes(values, noise_known=noise_known)
    frequency, present = data.frequency[lines], data.present[:, :, lines, 0]
    channels = [x.reshape(-1, *x.shape[2:]) for x in (values, present, amplitudes)]
    fit = compiled(_fit)(frequency, _lengths(frequency), *channels, noise_known)
    return _Fit(*(np.asarray(x).reshape(*shape, *x.shape[1:]) for x in fit))


def _lengths(frequency: np.ndarray) -> np.ndarray:
    """Length scales [Hz] from the distance of two lines to the width of the band."""
    width = np.ptp(frequency) if frequency.size > 1 else 1.0
    return np.geomspace(width / max(frequency.size - 1, 1), width, LENGTHS)


def _amplitudes(values: np.ndarray, *, noise_known: bool) -> np.ndarray:
    """Amplitudes [noise deviations] of the grid, by channel pair; the first stands for zero."""
    rms = np.sqrt(np.mean(values**2, axis=(2, 3)))
    largest = 3 * np.maximum(rms, 1) if noise_known else np.full_like(rms, 1e3)
    exponents = np.linspace(0, 1, AMPLITUDES - 1)
    geometric = 0.1 * (largest[..., None] / 0.1) ** exponents
    return np.concatenate([np.full((*rms.shape, 1), _ZERO_AMPLITUDE), geometric], axis=-1)


def _fit(
    frequency: Lines,
    lengths: Float[Array, "length"],
    values: Float[Array, "channel frequency part"],
    present: Bool[Array, "channel frequency"],
    amplitudes: Float[Array, "channel amplitude"],
    noise_known: bool,
) -> _Fit:
    def fit_channel(channel: tuple[Parts, Mask, Float[Array, "amplitude"]]) -> _Fit:
        value, mask, sizes = channel
        likelihood, noise = jax.vmap(
            lambda size: jax.vmap(
                lambda length: _likelihood(
                    _process(frequency, mask, size, length), value, mask, noise_known=noise_known
                )
            )(lengths)
        )(sizes)
        first, second = jnp.unravel_index(jnp.argmax(likelihood), likelihood.shape)
        size, length, level = sizes[first], lengths[second], noise[first, second]
        process = _process(frequency, mask, size, length)
        mean, variance = jax.vmap(lambda part: _conditioned(process, part))(value.T)
        deviation = jnp.sqrt(jnp.maximum(variance, 0.0)) * level
        ratio = likelihood[first, second] - likelihood[0, 0]
        return _Fit(mean.T, deviation.T, size * level, length, level, ratio)

    return jax.lax.map(fit_channel, (values, present, amplitudes))


def _process(frequency: Lines, mask: Mask, size: One, length: One) -> GaussianProcess:
    kernel = quasisep.Matern32(scale=length, sigma=size)
    diagonal = jnp.where(mask, 1.0, _VARIANCE_NOT_MEASURED)
    return GaussianProcess(kernel, frequency, diag=diagonal, assume_sorted=True)


def _conditioned(process: GaussianProcess, value: Lines) -> tuple[Lines, Lines]:
    conditional = process.condition(value, diag=jnp.zeros_like(value)).gp
    return conditional.loc, conditional.variance


def _likelihood(
    process: GaussianProcess, value: Parts, mask: Mask, *, noise_known: bool
) -> tuple[One, One]:
    """Log marginal likelihood, and the noise level: 1 where the noise is known, else the best."""
    solver = process.solver
    whitened = jax.vmap(solver.solve_triangular, in_axes=1)(value)
    parts = value.shape[1]
    count = parts * jnp.maximum(jnp.sum(mask), 1)
    squares = jnp.sum(whitened**2)
    level = jnp.asarray(1.0) if noise_known else jnp.sqrt(jnp.maximum(squares / count, 1e-300))
    likelihood = -0.5 * squares / level**2 - count * jnp.log(level)
    return likelihood - parts * solver.normalization(), level
