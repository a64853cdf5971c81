"""maps: in, an experiment and places to try; out, a labelled map of what is learnt at each.

Not known here: how information is estimated, how the best place is searched for.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from .._types import Progress, no_progress
from ..experiment import Experiment
from ..information._estimator import Estimator
from ..information.kde import KDE
from ._candidates import Candidates, candidates, nominal_values
from ._cells import Task, chunks
from ._running import run

CHUNK = 100
"""Cells of a chunk: about a second of the paper's sizes, far more than it costs to hand out."""


def information_map(
    experiment: Experiment,
    places: Mapping[str, Sequence[Any] | np.ndarray],
    *,
    estimator: Estimator | None = None,
    nominal: Mapping[str, float] | None = None,
    key: int = 0,
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
    nominal
        Nominal values of parameters, by name; by default the means of their priors.
    key
        Seed.
    executor
        Where chunks are computed, any `concurrent.futures` executor; by default here.
    store
        Folder in which finished chunks are kept. A second run computes only what is missing.
    chunk
        Cells of a chunk.
    progress
        Called with the share that is done.

    Returns
    -------
    xarray.Dataset
        `kl` and its standard error `kl_se` [nat], dimensions named after the transducers.

    Raises
    ------
    ValueError
        If a place is outside the structure, or the estimator cannot treat the experiment.
    """
    own = KDE() if estimator is None else estimator
    several = candidates(experiment, places)
    values = nominal_values(experiment, list(places), nominal)
    task = Task(experiment, own, key, values, {})
    found = np.full((*(len(one.laws) for one in several), 2), np.nan)
    for one, result in run(chunks(task, several, chunk), executor, store, progress):
        found[tuple(one.place.T)] = result
    return _labelled(several, found, own.settings() | {"key": key})


def _labelled(
    several: Sequence[Candidates], found: np.ndarray, settings: dict[str, Any]
) -> xr.Dataset:
    names = [one.name for one in several]
    units = {"units": "nat"}
    whole = xr.Dataset(
        {
            "kl": (names, found[..., 0], {**units, "long_name": "information"}),
            "kl_se": (names, found[..., 1], {**units, "long_name": "standard error"}),
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
