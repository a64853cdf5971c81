"""Smooth part of the residual of a fitted model, with a band.

A Gaussian process over frequency (Kennedy and O'Hagan, 2001, doi:10.1111/1467-9868.00294), fitted
to the residual of a finished fit, so that it shows where the model is wrong and moves no parameter.
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from scipy import stats
from tinygp import GaussianProcess
from tinygp.kernels import quasisep

from ._residuals import FORCE_LEVEL, Residuals, residuals

AMPLITUDES, LENGTHS = 24, 16
_ABSENT = 1e12
_NONE = 1e-6
_SIGNIFICANT = float(stats.norm.isf(0.025))


class _Fit(NamedTuple):
    """Discrepancy of some channels over the noise, [channel, frequency, part] and [channel]."""

    mean: Any
    deviation: Any
    amplitude: Any
    length: Any
    noise: Any
    log_ratio: Any


def discrepancy(posterior: xr.DataTree) -> xr.Dataset:
    """Smooth part of what the model leaves of the data, channel by channel.

    The residual at the posterior mean response is taken for a Gaussian process of Matern's kernel
    3/2 plus the noise, both in units of the noise's deviation at each line, so that the process
    is of one size at resonances and away from them. Real and imaginary part are independent and
    share amplitude and length. These two have the highest marginal likelihood on a grid; an
    unknown noise level is maximised in closed form.

    Parameters
    ----------
    posterior
        What `infer` returned.

    Returns
    -------
    xarray.Dataset
        In the unit of the outputs, `mean` and the 95 % band `low` to `high` at each line, and
        `away`, whether the band excludes zero. By channel pair (and `force_level` [N]): `amplitude`
        [noise deviations], `length` [Hz], `noise` (factor on the noise's deviation),
        `log_ratio` of the likelihood to that without any discrepancy, and the `share` of lines
        where it is away from zero (of a right model, at most 5 % on average).
    """
    return of(residuals(posterior))


def of(data: Residuals) -> xr.Dataset:
    """Discrepancy of residuals that are read already."""
    levels = np.unique(data.force_level)
    fits = [_fitted(data, np.flatnonzero(data.force_level == level)) for level in levels]
    joined = [np.concatenate([fit[i] for fit in fits], axis=2) for i in range(2)]
    mean, deviation = (np.where(data.present, x * data.scale, np.nan) for x in joined)
    margin = _SIGNIFICANT * deviation
    away = np.any(np.abs(mean) > margin, axis=-1)
    unit = {"units": data.template.attrs.get("units", "")}
    lines = {"mean": mean, "low": mean - margin, "high": mean + margin}
    dataset = xr.Dataset({name: data.labelled(x, **unit) for name, x in lines.items()})
    dataset["away"] = data.labelled_lines(away) > 0
    present = data.present[..., 0]
    shares = [_share(away, present & (data.force_level == level)) for level in levels]
    columns = {name: [getattr(fit, name) for fit in fits] for name in _Fit._fields[2:]}
    return _by_channel(columns | {"share": shares}, dataset)


def _by_channel(columns: dict[str, list[np.ndarray]], dataset: xr.Dataset) -> xr.Dataset:
    """Add numbers of each channel pair; of each force level too, where these are told."""
    pair = ("sensor", "actuator")
    if FORCE_LEVEL not in dataset.dims:
        return dataset.assign({name: (pair, values[0]) for name, values in columns.items()})
    stacked = {name: ((FORCE_LEVEL, *pair), np.stack(values)) for name, values in columns.items()}
    return dataset.assign(stacked)


def _share(away: np.ndarray, here: np.ndarray) -> np.ndarray:
    return np.sum(away & here, axis=-1) / np.maximum(here.sum(axis=-1), 1)


def _fitted(data: Residuals, lines: np.ndarray) -> _Fit:
    """Fit every channel pair at one force level."""
    shape = data.residual.shape[:2]
    known = data.deviation is not None
    values = (data.residual / data.scale)[:, :, lines]
    amplitudes = _amplitudes(values, known=known)
    at, present = data.frequency[lines], data.present[:, :, lines, 0]
    flat = [x.reshape(-1, *x.shape[2:]) for x in (values, present, amplitudes)]
    found = _fit(at, _lengths(at), *flat, known=known)
    return _Fit(*(np.asarray(x).reshape(*shape, *x.shape[1:]) for x in found))


def _lengths(frequency: np.ndarray) -> np.ndarray:
    """Length scales [Hz] from the distance of two lines to the whole band."""
    whole = np.ptp(frequency) if frequency.size > 1 else 1.0
    return np.geomspace(whole / max(frequency.size - 1, 1), whole, LENGTHS)


def _amplitudes(values: np.ndarray, *, known: bool) -> np.ndarray:
    """Amplitudes over the noise, by channel pair, up to where no residual is larger."""
    size = np.sqrt(np.mean(values**2, axis=(2, 3)))
    largest = 3 * np.maximum(size, 1) if known else np.full_like(size, 1e3)
    steps = np.linspace(0, 1, AMPLITUDES - 1)
    geometric = 0.1 * (largest[..., None] / 0.1) ** steps
    return np.concatenate([np.full((*size.shape, 1), _NONE), geometric], axis=-1)


@partial(jax.jit, static_argnames="known")
def _fit(
    at: Any,
    lengths: Any,
    values: Any,
    present: Any,
    amplitudes: Any,
    *,
    known: bool,
) -> _Fit:
    def one(channel: Any) -> _Fit:
        value, there, sizes = channel
        diagonal = jnp.where(there, 1.0, _ABSENT)
        grid = jax.vmap(
            lambda size: jax.vmap(
                lambda length: _likelihood(at, value, there, size, length, known=known)
            )(lengths)
        )(sizes)
        likelihood, noise = grid
        first, second = jnp.unravel_index(jnp.argmax(likelihood), likelihood.shape)
        size, length, level = sizes[first], lengths[second], noise[first, second]
        process = _process(at, diagonal, size, length)
        mean, variance = jax.vmap(lambda part: _conditioned(process, part))(value.T)
        deviation = jnp.sqrt(jnp.maximum(variance, 0.0)) * level
        ratio = likelihood[first, second] - likelihood[0, 0]
        return _Fit(mean.T, deviation.T, size * level, length, level, ratio)

    return jax.lax.map(one, (values, present, amplitudes))


def _process(at: Any, diagonal: Any, size: Any, length: Any) -> GaussianProcess:
    kernel = quasisep.Matern32(scale=length, sigma=size)
    return GaussianProcess(kernel, at, diag=diagonal, assume_sorted=True)


def _conditioned(process: GaussianProcess, value: Any) -> tuple[Any, Any]:
    given = process.condition(value, diag=jnp.zeros_like(value)).gp
    return given.loc, given.variance


def _likelihood(at: Any, value: Any, there: Any, size: Any, length: Any, *, known: bool) -> Any:
    """Log marginal likelihood, and the noise level: one where it is known, else the best."""
    solver = _process(at, jnp.where(there, 1.0, _ABSENT), size, length).solver
    whitened = jax.vmap(solver.solve_triangular, in_axes=1)(value)
    parts = value.shape[1]
    count = parts * jnp.maximum(jnp.sum(there), 1)
    squares = jnp.sum(whitened**2)
    level = jnp.asarray(1.0) if known else jnp.sqrt(jnp.maximum(squares / count, 1e-300))
    likelihood = -0.5 * squares / level**2 - count * jnp.log(level)
    return likelihood - parts * solver.normalization(), level
