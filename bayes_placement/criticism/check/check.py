"""Test of a fitted model against its data."""

import numpy as np
import xarray as xr

from ..._shared.arguments import arguments_checked
from ..._shared.errors import InputError
from ...inference.chi2 import LEVEL
from ...inference.output_residuals import Residuals, response_when_exact
from ...inference.results import data_faults_of
from . import discrepancy
from ._edges import edges, model_error
from ._residuals import Grouping, groupings, residuals
from ._statistics import Statistics, correlations, noise_needed
from .misfit import Misfit, Verdict, decides


@arguments_checked
def check(posterior: xr.DataTree, *, level: float = LEVEL, bands: int = 8) -> Misfit:
    """Test whether a fitted model explains the data, and where it fails.

    Chi2 per datum is the mean of (measured - predicted)^2 / variance over real outputs, which is
    that of |error|^2 / E|error|^2 over complex ones, at the posterior mean m of the response. For a
    correct model its mean is 1 at the true response, and less at m, which was fitted. For data
    y = f + e of a correct model E{(y - m)(y - m)'} = E{e e'} - E{covariance of f given y}, since
    f - m is uncorrelated with any function of y. The sum over N real outputs is therefore
    N - sum(posterior variance of f / noise variance): N less the number p of parameters that the
    data determine. N complex data are 2 N outputs, and their mean is 1 - p / (2 N). This holds for
    any posterior, averaged over truths from the prior. Where all parameters are determined it is
    the N - p of least squares. Spread and p-value are those of the linear Gaussian model.

    Noise is assumed independent between lines; `noise.Covariance`, or the window of a Fourier
    transform without averaging over lines, correlates neighbours, and whiteness then fails.

    Parameters
    ----------
    posterior
        What `infer` returned.
    level
        Probability that a correct model does not pass.
    bands
        Number of frequency bands with as many lines each; reduced where a band would have fewer
        than five lines.

    Returns
    -------
    Misfit
        Tables, p-values and sentences.

    Raises
    ------
    ValueError
        If the tree is no result of an inference or has a single draw, if `bands` is less than 1,
        or if `level` is not between 0 and 1.

    Examples
    --------
    >>> misfit = bp.check(posterior)
    >>> misfit.passed, round(float(misfit.overall["chi2_per_datum"]), 1)
    (True, 0.7)
    """
    _check(level, bands)
    data = residuals(posterior)
    statistics, noise_known = Statistics(data), data.deviation is not None
    tables = {
        name: grouping.dataset(_columns(statistics, grouping))
        for name, grouping in groupings(data, bands).items()
    }
    overall = tables.pop("overall")
    channels = tables["channel"]["whiteness"].values.ravel().tolist()
    whiteness = _combined(float(overall["whiteness"]), channels)
    return Misfit(
        overall=overall.assign(whiteness=whiteness),
        groups={name: _corrected(table, noise_known) for name, table in tables.items()},
        response=_response(data),
        edges=edges(posterior),
        correlation=correlations(data),
        discrepancy=discrepancy.of(data),
        level=level,
        noise_known=noise_known,
        data_faults=tuple(data_faults_of(posterior)),
        model_error=model_error(posterior),
        noise_needed=noise_needed(data, posterior),
        chi2_without_errors=_chi2_without_errors(data, posterior),
    )


def verdict(posterior: xr.DataTree) -> Verdict:
    """The verdict of `check` alone: no groups, bands and discrepancies, which take time."""
    data = residuals(posterior)
    statistics, masks = Statistics(data), groupings(data, bands=1)
    (everything,) = masks["overall"].masks()
    overall = statistics.chi2(everything)
    if data.deviation is None:
        channels = [statistics.whiteness(channel) for channel in masks["channel"].masks()]
        overall["whiteness"] = _combined(statistics.whiteness(everything), channels)
    return Verdict(
        overall=overall,
        level=LEVEL,
        noise_known=data.deviation is not None,
        noise_needed=noise_needed(data, posterior),
        has_model_error=bool(model_error(posterior)),
    )


def _check(level: float, bands: int) -> None:
    if not 0 < level < 1:
        raise InputError(
            f"level={level} was given; a probability between 0 and 1 is needed, since it is the "
            "probability that a correct model fails: check(posterior, level=0.01)."
        )
    if bands < 1:
        raise InputError(
            f"bands={bands} was given; at least 1 is needed, since every line belongs to a "
            "frequency band: check(posterior, bands=8)."
        )


def _columns(statistics: Statistics, grouping: Grouping) -> dict[str, list[float]]:
    rows = [statistics.of(group) for group in grouping.masks()]
    return {name: [row[name] for row in rows] for name in rows[0]}


def _combined(overall: float, channels: list[float]) -> float:
    """Smaller of the p-values of all residuals and of the worst channel (Bonferroni)."""
    defined = [value for value in channels if not np.isnan(value)]
    if not defined:  # too few neighbouring lines in any one of them
        return overall
    return float(np.minimum(1.0, 2 * np.minimum(overall, len(defined) * min(defined))))


def _corrected(table: xr.Dataset, noise_known: bool) -> xr.Dataset:
    value = table[decides(noise_known)]
    return table.assign(corrected=(value * value.count()).clip(max=1.0))


def _chi2_without_errors(data: Residuals, posterior: xr.DataTree) -> float:
    """Chi2 per datum of the response without the errors of the model; NaN where it has none."""
    exact = response_when_exact(posterior)
    if exact is None or data.deviation is None:
        return float("nan")
    relative = (data.measured - exact) / data.deviation
    return float(np.mean(relative[data.present] ** 2))


def _response(data: Residuals) -> xr.Dataset:
    """Residuals and misfit at each line."""
    relative = data.residual / data.scale
    unit = data.template.attrs.get("units", "")
    deviations = (
        "noise deviations" if data.deviation is not None else "deviations of the fitted noise"
    )
    misfit = np.sqrt(np.mean(relative**2, axis=-1))
    return xr.Dataset(
        {
            "residual": data.labelled(data.residual, units=unit),
            "residual_over_noise": data.labelled(relative, units=deviations),
            "misfit": data.labelled_lines(misfit, units=deviations),
        }
    )
