"""Whether a fitted model explains the data, and where it does not."""

import numpy as np
import xarray as xr

from ..._types import InputError
from ...inference.bands import amplitude
from . import _edges, correlation, discrepancy
from ._residuals import Grouping, Residuals, band_of, groupings, residuals
from ._statistics import Statistics
from .misfit import Misfit, decides

LEVEL = 0.01
"""Probability that a right model does not pass."""


def check(posterior: xr.DataTree, *, level: float = LEVEL, bands: int = 8) -> Misfit:
    """Say whether a fitted model explains the data, and where it fails.

    Chi2 per datum is the mean of (measured - predicted)^2 / variance over real outputs, which is
    that of |error|^2 / E|error|^2 over complex ones, at the posterior mean m of the response. At
    the true response a right model gives 1, and so it does, on average, at a random draw from the
    posterior. At m, which was fitted, it gives less. For data y = f + e of a right model
    E{(y - m)(y - m)'} = E{e e'} - E{covariance of f given y}, since f - m is uncorrelated with
    any function of y; so the sum over N real outputs is N - sum(posterior variance of f / noise
    variance), N less the number p of parameters that the data determine; N complex data are 2 N
    outputs, and their mean is 1 - p / (2 N). This holds for any posterior, averaged over truths
    from the prior. Where all parameters are determined it is the N - p of least squares, which
    holds at the best draw too. Spread and p-value use the law of the linear Gaussian model.

    Noise is taken for independent between lines; `noise.Covariance`, or the window of a Fourier
    transform without averaging over lines, makes neighbours alike and whiteness fail.

    Parameters
    ----------
    posterior
        What `infer` returned.
    level
        Probability that a right model does not pass.
    bands
        Number of frequency bands, of as many lines each; fewer, where these would be under five.

    Returns
    -------
    Misfit
        Tables, p-values, and words.

    Raises
    ------
    ValueError
        If the tree is no result of an inference or has a single draw, or if no band or a level
        outside 0 to 1 is asked for.
    """
    _check(level, bands)
    data = residuals(posterior)
    ways = groupings(data, bands)
    statistics, known = Statistics(data), data.deviation is not None
    tables = {name: way.dataset(_columns(statistics, way)) for name, way in ways.items()}
    overall = tables.pop("overall")
    overall["whiteness"] = _both_looks(overall["whiteness"], tables["channel"]["whiteness"])
    return Misfit(
        overall=overall,
        groups={name: _corrected(table, known) for name, table in tables.items()},
        response=_response(data),
        edges=_edges.edges(posterior),
        correlation=correlation.correlations(data),
        discrepancy=discrepancy.of(data),
        level=level,
        noise_known=known,
    )


def _check(level: float, bands: int) -> None:
    if not 0 < level < 1:
        raise InputError(
            f"level={level} was given; a probability between 0 and 1 is needed, since it is how "
            "often a right model may fail: check(posterior, level=0.01)."
        )
    if bands < 1:
        raise InputError(
            f"bands={bands} was given; at least one is needed, since every line lies in a "
            "frequency band: check(posterior, bands=8)."
        )


def _columns(statistics: Statistics, way: Grouping) -> dict[str, list[float]]:
    rows = [statistics.of(group) for group in way.masks()]
    return {name: [row[name] for row in rows] for name in rows[0]}


def _both_looks(together: xr.DataArray, channels: xr.DataArray) -> xr.DataArray:
    """Smaller p-value of all residuals and of the worst channel, corrected for looking often."""
    worst = float(channels.count()) * float(channels.min())
    return (2 * together.clip(max=worst)).clip(max=1.0)


def _corrected(table: xr.Dataset, noise_known: bool) -> xr.Dataset:
    value = table[decides(noise_known)]
    return table.assign(corrected=(value * value.count()).clip(max=1.0))


def _response(data: Residuals) -> xr.Dataset:
    """What figures show, line by line."""
    drawn = data.draws if data.replicates is None else data.replicates
    _, low, high = band_of(amplitude(drawn, -1))
    over = data.residual / data.scale
    shown = {"measured": amplitude(data.measured, -1), "mean": amplitude(data.mean, -1)}
    shown |= {"low": low, "high": high, "misfit": np.sqrt(np.mean(over**2, axis=-1))}
    unit = data.template.attrs.get("units", "")
    units = dict.fromkeys(shown, f"log10 of {unit}" if data.residual.shape[-1] == 2 else unit)
    units["misfit"] = (
        "noise deviations" if data.deviation is not None else "deviations of the fitted noise"
    )
    lines = {name: data.labelled_lines(values, units=units[name]) for name, values in shown.items()}
    parts = {
        "residual": data.labelled(data.residual, units=unit),
        "residual_over_noise": data.labelled(over, units=units["misfit"]),
    }
    return xr.Dataset(parts | lines)
