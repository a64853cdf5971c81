"""place: in, an experiment and places to try; out, the placement that teaches most.

Not known here: how information is estimated, how placements are searched through.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .._types import Progress, no_progress
from .._vectors import Recorded
from ..experiment import Experiment
from ..information._estimator import Estimator, spread
from ..information.kde import KDE
from ._evaluation import Evaluation
from ._question import only_about
from ._rules import Rules
from .maps import CHUNK
from .search import Exhaustive, Search, Tried


@dataclass(frozen=True)
class Placement:
    """The best placement that was tried, and the others.

    Parameters
    ----------
    positions
        Recorded place of each transducer [m], by name.
    kl, kl_se
        What is learnt there, and its standard error [nat].
    ahead, ahead_se
        By how much more than at the second best placement, and its standard error [nat]; much of
        both errors is common.
    tried
        All placements, one a row, the best first.
    """

    positions: dict[str, Any]
    kl: float
    kl_se: float
    ahead: float
    ahead_se: float
    tried: pd.DataFrame

    def __str__(self) -> str:
        """Say where, how much is learnt, and how sure that is."""
        where = ", ".join(f"{name} at {_told(at)} m" for name, at in self.positions.items())
        sure = "" if self.ahead > 2 * self.ahead_se else ", which is no difference to speak of"
        return (
            f"Best of {len(self.tried)} placements: {where}; {self.kl:.3g} ± {self.kl_se:.2g} nat, "
            f"{self.ahead:.2g} ± {self.ahead_se:.2g} more than the second best{sure}."
        )


def place(
    experiment: Experiment,
    places: Mapping[str, Sequence[Any] | np.ndarray],
    *,
    search: Search | None = None,
    estimator: Estimator | None = None,
    about: Sequence[str] | None = None,
    nominal: Mapping[str, float] | None = None,
    forbidden: Sequence[tuple[Recorded, Recorded]] = (),
    least_distance: float = 0.0,
    key: int = 0,
    executor: Executor | None = None,
    store: str | Path | None = None,
    progress: Progress = no_progress,
) -> Placement:
    """Find where some sensors and actuators tell most about the parameters, Eq. (34).

    Transducers that are not named stay where they are: those are mounted already.

    Parameters
    ----------
    experiment
        The experiment; each transducer that is moved keeps its tolerance.
    places
        Recorded positions [m] (or supports) to try, by the name of the transducer.
    search
        `design.Exhaustive()` by default, or `design.Sequential()`.
    estimator, about, nominal, key, executor, store, progress
        See `information_map`.
    forbidden
        Regions in which nothing may be recorded: low and high corner [m].
    least_distance
        Least distance [m] between sensors, and between actuators.

    Raises
    ------
    ValueError
        If no placement is allowed, or the estimator cannot treat the experiment.
    """
    own = KDE() if estimator is None else estimator
    rules = Rules(tuple(forbidden), float(least_distance))
    asked, given = only_about(experiment, about, nominal)
    evaluation = Evaluation(asked, own, key, given, executor, store, CHUNK, progress)
    one = (Exhaustive() if search is None else search).tried(evaluation, places, rules)
    return _best(_distinct(one))


def _distinct(tried: Tried) -> Tried:
    """Each placement once."""
    rows = [tuple(np.ravel(list(one.values())).tolist()) for one in tried.places]
    first = sorted({row: number for number, row in reversed(list(enumerate(rows)))}.values())
    return Tried([tried.places[number] for number in first], tried.found[first])


def _best(tried: Tried) -> Placement:
    order = np.argsort(-tried.found[:, 0], kind="stable")
    best, second = tried.found[order[0]], tried.found[order[min(1, len(order) - 1)]]
    table = pd.DataFrame([_row(tried.places[number]) for number in order])
    table["kl"], table["kl_se"] = tried.found[order, 0], spread(tried.found[order, 1:])
    return Placement(
        positions=tried.places[order[0]],
        kl=float(best[0]),
        kl_se=float(spread(best[1:])),
        ahead=float(best[0] - second[0]),
        ahead_se=float(spread(best[1:] - second[1:])),
        tried=table,
    )


def _row(places: Mapping[str, Any]) -> dict[str, float]:
    """Coordinates of each transducer."""
    found = {}
    for name, at in places.items():
        if np.ndim(at) == 0:
            found[name] = float(at)
        else:
            found |= {f"{name}.{axis}": float(x) for axis, x in zip("xyz", at, strict=True)}
    return found


def _told(at: Any) -> str:
    if np.ndim(at) == 0:
        return f"{float(at):.4g}"
    return f"({', '.join(f'{float(x):.4g}' for x in at)})"
