"""Maps of the information gain over the positions of sensors and actuators."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from .._shared.arguments import arguments_checked, check_count
from .._shared.dimensions import Key
from .._shared.errors import InfeasibleError, InputError
from .._shared.garbage import long_computation
from .._shared.progress import Progress, shown
from .._shared.reprs import with_short_repr
from ..experiment.experiment import Experiment
from ._candidates import Candidates, candidates, combinations
from .information.estimator import Estimator, jackknife_error
from .running.evaluation import CHUNK, MOST_LINES, Evaluation

SIGNIFICANT = 2.0
"""Standard errors above which a difference is significant."""


@arguments_checked
@long_computation()
def information_map(
    experiment: Experiment,
    places: Mapping[str, Sequence[object] | np.ndarray],
    *,
    estimator: Estimator | None = None,
    about: Sequence[str] | None = None,
    nominal: Mapping[str, float] | None = None,
    key: int | Key = 0,
    lines: int | None = MOST_LINES,
    executor: Executor | None = None,
    store: str | Path | None = None,
    chunk: int = CHUNK,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Information about the parameters at each placement of some sensors and actuators.

    All placements share their random points, so that differences between them are smooth.

    Parameters
    ----------
    experiment
        The experiment; each transducer that is moved keeps its tolerance.
    places
        Recorded positions [m] (or tolerance regions) to try, by the name of the transducer: a grid
        of all combinations.
    estimator
        An estimator of `information`; by default the paper's, `information.KernelGain()`.
    about
        Names of the parameters of interest; all others are held at nominal values. By default all.
    nominal
        Nominal values of parameters, by name; by default the means of their priors.
    key
        Seed or JAX key.
    lines
        Frequency lines that are used, evenly over the band, where the experiment has more: more of
        them take longer and need more draws. None for all.
    executor
        Executor that computes the chunks: `workers(4)`, or any of `concurrent.futures`; by default
        this process, for many chunks with a helper on each further core, three at most. The result
        is the same, bit for bit.
    store
        Folder for finished chunks, one file each, named by a hash of all its inputs. A second run
        computes only the missing ones.
    chunk
        Placements of a chunk; a second or more of work is far above the cost of dispatching it.
    progress
        Called with the share that is done; by default a bar in a terminal or notebook, and nothing
        elsewhere.

    Returns
    -------
    xarray.Dataset
        `information_gain` and its standard error `information_gain_se` [nat], dimensions named
        after the transducers; `information_gain_jackknife`, the estimate without each replicate of
        the random points, for `lead`. NaN where it is not finite, as on a support that does not
        move.

    Raises
    ------
    InputError
        If a place is outside the structure, the estimator cannot treat the experiment, or it
        cannot be sent to another process.
    WorkerError
        If a worker was lost and the executor cannot continue, or a worker cannot unpack its chunk.

    Examples
    --------
    >>> learnt = bp.information_map(experiment, places, estimator=estimator)
    >>> learnt["information_gain"].sizes["s1"]
    3
    """
    check_count("chunk", chunk, 1, "information_map(..., chunk=100)")
    with shown(progress, "map") as report:
        evaluation = Evaluation.of(
            experiment,
            estimator=estimator,
            about=about,
            nominal=nominal,
            key=key,
            lines=lines,
            executor=executor,
            store=store,
            chunk=chunk,
            progress=report,
        )
        moved = candidates(evaluation.experiment, places)
        shape = tuple(len(transducer.positions) for transducer in moved)
        gain = evaluation.at(moved, combinations(moved)).reshape(*shape, -1)
    gain[np.isneginf(gain)] = np.nan
    used = {"key": evaluation.seed, "lines": int(np.size(evaluation.experiment.frequency))}
    return _labelled(moved, gain, evaluation.estimator.settings() | used)


@with_short_repr
class Lead(NamedTuple):
    """Lead of the best placement over another [nat].

    Parameters
    ----------
    best, other
        Index of each along the dimensions of the map.
    difference, difference_se
        Information gain of the best less that of the other, and its standard error.

    Examples
    --------
    >>> lead = bp.design.lead(learnt)
    >>> lead.best, lead.other, lead.difference > 0
    ({'s1': 0}, {'s1': 1}, True)
    """

    best: dict[str, int]
    other: dict[str, int]
    difference: float
    difference_se: float


@arguments_checked
def lead(learnt: xr.Dataset, other: Mapping[str, int] | None = None) -> Lead:
    """Compare the best placement of a map with another.

    All placements share their random points, so that most of their errors cancels.

    Parameters
    ----------
    learnt
        A map of `information_map`.
    other
        Index along each of its dimensions; by default the second best.

    Raises
    ------
    InfeasibleError
        If the information gain is finite at no placement.

    Examples
    --------
    >>> bp.design.lead(learnt, {"s1": 2}).difference > 0
    True
    """
    gain = learnt["information_gain"]
    names = [str(name) for name in gain.dims]
    order = ranked(gain.values.ravel())
    best, second = (
        dict(zip(names, map(int, np.unravel_index(number, gain.shape)), strict=True))
        for number in order[[0, min(1, len(order) - 1)]]
    )
    compared = second if other is None else _checked_cell(gain, other)
    return Lead(best, compared, *difference(learnt.isel(best), learnt.isel(compared)))


def _checked_cell(gain: xr.DataArray, other: Mapping[str, int]) -> dict[str, int]:
    """Refuse what is no cell of a map."""
    sizes = {str(name): size for name, size in gain.sizes.items()}
    if other.keys() != sizes.keys() or not all(0 <= other[name] < sizes[name] for name in sizes):
        raise InputError(
            f"other={dict(other)} was given; a number from 0 for each of the dimensions is needed, "
            f"below {sizes}, since the best cell is compared with one: other="
            f"{dict.fromkeys(sizes, 0)}."
        )
    return dict(other)


def ranked(gain: np.ndarray) -> np.ndarray:
    """Numbers of placements [placement] in the order of their information gain, the best first."""
    if not np.isfinite(gain).any():
        raise InfeasibleError(
            f"At none of {gain.size} placements is the information finite: where the structure "
            "does not move, as on a support, the logarithm of the response is infinite. Try places "
            "that move."
        )
    return np.argsort(-np.nan_to_num(gain, nan=-np.inf), kind="stable")


def difference(cell: xr.Dataset, other: xr.Dataset) -> tuple[float, float]:
    """Information gain of one cell less that of another, and the standard error of that [nat]."""
    return difference_of(_estimates(cell), _estimates(other))


def difference_of(estimates: np.ndarray, baseline: np.ndarray) -> tuple[float, float]:
    """Information gain of one placement less that of another, and the standard error [nat].

    Both are the estimate, then that without each replicate; common errors cancel.
    """
    differences = estimates - baseline
    return float(differences[0]), float(jackknife_error(differences[1:]))


def _estimates(cell: xr.Dataset) -> np.ndarray:
    jackknife = cell["information_gain_jackknife"].values
    return np.concatenate([[float(cell["information_gain"])], jackknife])


@arguments_checked
def rivals(learnt: xr.Dataset) -> xr.DataArray:
    """Return which placements are not significantly worse than the best (two standard errors).

    Examples
    --------
    >>> bool(bp.design.rivals(learnt)[0])  # the best is none of those that are worse
    True
    """
    gain, jackknife = learnt["information_gain"], learnt["information_gain_jackknife"]
    names = [str(name) for name in gain.dims]
    best = lead(learnt).best
    behind = (gain.isel(best) - gain).transpose(*names).values
    without = (jackknife.isel(best) - jackknife).transpose(*names, "replicate").values
    return gain.copy(data=behind <= SIGNIFICANT * jackknife_error(without))


def _labelled(
    moved: Sequence[Candidates], gain: np.ndarray, settings: Mapping[str, int | float | str]
) -> xr.Dataset:
    names = [transducer.name for transducer in moved]
    words = {"units": "nat", "long_name": "information gain"}
    error = {"units": "nat", "long_name": "standard error of the information gain"}
    learnt = xr.Dataset(
        {
            "information_gain": (names, gain[..., 0], words),
            "information_gain_se": (names, jackknife_error(gain[..., 1:]), error),
            "information_gain_jackknife": ([*names, "replicate"], gain[..., 1:], words),
        },
        attrs=settings,
    )
    for transducer in moved:
        learnt = learnt.assign_coords(_coordinates(transducer))
    return learnt


def _coordinates(moved: Candidates) -> dict[str, tuple[str, np.ndarray, dict[str, str]]]:
    """Recorded positions along the dimension of a transducer: one coordinate, or three."""
    if moved.recorded.ndim == 1:
        words = {"units": "m", "long_name": f"position of {moved.name}"}
        return {moved.name: (moved.name, moved.recorded, words)}
    return {
        f"{moved.name}.{axis}": (moved.name, column, {"units": "m"})
        for axis, column in zip("xyz", moved.recorded.T, strict=True)
    }
