"""maps: in, an experiment and places to try; out, a labelled map of what is learnt at each.

Not known here: how information is estimated, how the best place is searched for.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float

from .._random import integer_seed
from .._types import InfeasibleError, Key, Progress, no_progress
from ..experiment.experiment import Experiment
from ._candidates import Candidates, candidates
from ._question import only_about
from .information._estimator import Estimator, spread
from .information.kde import KDE
from .running._cells import grid
from .running._evaluation import Evaluation

DOUBT = 2.0
"""Standard errors, up to which a difference is not taken for real."""

CHUNK = 100
"""Cells of a chunk: about a second of the paper's sizes, far more than it costs to hand out."""


def information_map(
    experiment: Experiment,
    places: Mapping[str, Sequence[Any] | np.ndarray],
    *,
    estimator: Estimator | None = None,
    about: Sequence[str] | None = None,
    nominal: Mapping[str, float] | None = None,
    key: int | Key = 0,
    executor: Executor | None = None,
    store: str | Path | None = None,
    chunk: int = CHUNK,
    progress: Progress = no_progress,
) -> xr.Dataset:
    """Information about the parameters at each placement of some sensors and actuators.

    Everything random is common to all placements, so that differences are smooth.

    Parameters
    ----------
    experiment
        The experiment; each transducer that is moved keeps its tolerance.
    places
        Recorded positions [m] (or supports) to try, by the name of the transducer: a grid of all
        combinations.
    estimator
        One of `information`; by default the paper's, `information.KDE()`.
    about
        Names of the parameters that are to be learnt; all others are held at nominal values. By
        default all.
    nominal
        Nominal values of parameters, by name; by default the means of their priors.
    key
        Seed or JAX key.
    executor
        Where chunks are computed: `workers(4)`, or any `concurrent.futures` executor; by default
        here. The result is the same, bit for bit.
    store
        Folder in which finished chunks are kept, one netCDF file each, named by all that
        determines it. A second run computes only what is missing.
    chunk
        Cells of a chunk; a second or more of work is far more than it costs to hand it out.
    progress
        Called with the share that is done; `progress_bar()` makes one.

    Returns
    -------
    xarray.Dataset
        `kl` and its standard error `kl_se` [nat], dimensions named after the transducers;
        `kl_without`, the same without each replicate of the random points, for `lead`. NaN where
        nothing can be told, as on a support that does not move.

    Raises
    ------
    ValueError
        If a place is outside the structure, the estimator cannot treat the experiment, or it
        cannot be sent to another process.
    RuntimeError
        If a worker was lost and the executor cannot go on, or a worker cannot read what it is sent.
    """
    own, seed = KDE() if estimator is None else estimator, integer_seed(key)
    asked, given = only_about(experiment, about, nominal)
    several = candidates(asked, places)
    shape = tuple(len(one.laws) for one in several)
    whole = Evaluation(asked, own, seed, given, executor, store, chunk, progress)
    found = whole.at(several, grid(several)).reshape(*shape, -1)
    found[np.isneginf(found)] = np.nan
    return _labelled(several, found, own.settings() | {"key": seed})


class Lead(NamedTuple):
    """By how much the best placement is better than another [nat].

    Parameters
    ----------
    best, other
        Index of each along the dimensions of the map.
    difference, error
        Information of the best less that of the other, and its standard error.
    """

    best: dict[str, int]
    other: dict[str, int]
    difference: float
    error: float


def lead(whole: xr.Dataset, other: Mapping[str, int] | None = None) -> Lead:
    """Compare the best placement of a map with another.

    All placements share their random points, so that much of their errors is common.

    Parameters
    ----------
    whole
        A map of `information_map`.
    other
        Index along each of its dimensions; by default the second best.

    Raises
    ------
    ValueError
        If nothing is known at any placement.
    """
    names = [str(name) for name in whole["information_gain"].dims]
    kl = np.nan_to_num(whole["information_gain"].values, nan=-np.inf)
    if np.isneginf(kl).all():
        raise InfeasibleError(nothing_told(kl.size))
    order = np.argsort(kl, axis=None)[::-1]
    best, second = (
        dict(zip(names, map(int, np.unravel_index(place, kl.shape)), strict=True))
        for place in order[[0, min(1, len(order) - 1)]]
    )
    compared = second if other is None else dict(other)
    return Lead(best, compared, *difference(whole.isel(best), whole.isel(compared)))


def difference(one: xr.Dataset, other: xr.Dataset) -> tuple[float, float]:
    """Information of one cell less that of another, and the standard error of that [nat]."""
    found = (
        np.concatenate([[float(at["information_gain"])], at["information_gain_jackknife"].values])
        for at in (one, other)
    )
    return ahead(*found)


def nothing_told(count: int) -> str:
    """Say that information is finite nowhere."""
    return (
        f"At none of {count} placements is the information finite: where nothing moves, as on a "
        "support, the logarithm of the response is infinite. Try places that move."
    )


def ahead(
    best: Float[np.ndarray, "estimate"], other: Float[np.ndarray, "estimate"]
) -> tuple[float, float]:
    """By how much one placement is better than another, and the standard error of that [nat].

    Parameters
    ----------
    best, other
        Information of each, in all and without each replicate; what is common cancels.
    """
    apart = best - other
    return float(apart[0]), float(spread(apart[1:]))


def rivals(whole: xr.Dataset) -> xr.DataArray:
    """Tell which placements of a map are no worse than the best, within two standard errors."""
    values = whole["information_gain_jackknife"]
    names = [str(name) for name in whole["information_gain"].dims]
    best = lead(whole).best
    behind = (values.isel(best) - values).transpose(*names, "replicate").values
    lost = (
        (whole["information_gain"].isel(best) - whole["information_gain"]).transpose(*names).values
    )
    return whole["information_gain"].copy(data=lost <= DOUBT * spread(behind))


def _labelled(
    several: Sequence[Candidates], found: np.ndarray, settings: dict[str, Any]
) -> xr.Dataset:
    names = [one.name for one in several]
    units = {"units": "nat"}
    whole = xr.Dataset(
        {
            "information_gain": (names, found[..., 0], {**units, "long_name": "information"}),
            "information_gain_se": (
                names,
                spread(found[..., 1:]),
                {**units, "long_name": "standard error"},
            ),
            "information_gain_jackknife": ([*names, "replicate"], found[..., 1:], units),
        },
        attrs=settings,
    )
    for one in several:
        if one.recorded.ndim == 1:
            attributes = {"units": "m", "long_name": f"position of {one.name}"}
            whole = whole.assign_coords({one.name: (one.name, one.recorded, attributes)})
        else:
            triple = {
                f"{one.name}.{axis}": (one.name, column, {"units": "m"})
                for axis, column in zip("xyz", one.recorded.T, strict=True)
            }
            whole = whole.assign_coords(triple)
    return whole
