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

from .._random import integer_seed
from .._types import InfeasibleError, Key, Progress, no_progress
from ..experiment.experiment import Experiment
from ..positions.bounds import position_text
from ..positions.vectors import Recorded
from ._question import only_about
from .information._estimator import Estimator, spread
from .information.kde import KDE
from .maps import CHUNK, ahead, nothing_told
from .running._evaluation import Evaluation
from .search._offer import Offer, Places
from .search._rules import Rules
from .search.exhaustive import Exhaustive
from .search.search import Search, Tried

SLIGHT = 0.01
"""Share of the information gain below which a lead is not significant, whatever its error."""


@dataclass(frozen=True)
class Placement:
    """The best placement that was tried, and the others.

    Parameters
    ----------
    positions
        Recorded place of each transducer that is placed [m], by name.
    omitted
        Names of those that are not worth their cost.
    information_gain, information_gain_se
        What is learnt there, and its standard error [nat].
    cost
        What those that are placed cost [nat].
    lead, lead_se
        By how much more is learnt, less cost, than at the second best placement, and its standard
        error [nat]; much of both errors is common. Placements next to the best one in a region are
        not counted as the second best.
    table
        All placements, one a row, the best first: places [m], `information_gain`,
        `information_gain_se`, `cost` and `net_gain`, the information gain less the cost [nat].
    search
        How it was searched for.
    evaluations
        How often information was estimated.
    """

    positions: dict[str, Any]
    omitted: tuple[str, ...]
    information_gain: float
    information_gain_se: float
    cost: float
    lead: float
    lead_se: float
    table: pd.DataFrame
    search: str
    evaluations: int

    @property
    def net_gain(self) -> float:
        """What is learnt less what it costs [nat]."""
        return self.information_gain - self.cost

    def __str__(self) -> str:
        """Say where, how much is learnt, and how sure that is."""
        where = ", ".join(
            f"{name} at {position_text(np.round(at, 4))} m" for name, at in self.positions.items()
        )
        price = f", less {self.cost:.3g} nat of cost" if self.cost else ""
        return (
            f"Best of {len(self.table)} placements: {where or 'nothing placed'}; "
            f"{self.information_gain:.3g} ± {self.information_gain_se:.2g} nat{price}"
            f"{self._lead()}.{self._left_out()}"
        )

    def _lead(self) -> str:
        if not np.isfinite(self.lead):
            return ""
        least = max(2 * self.lead_se, SLIGHT * abs(self.information_gain))
        sure = "" if self.lead > least else ", which is not significant"
        return f", {self.lead:.2g} ± {self.lead_se:.2g} more than the second best{sure}"

    def _left_out(self) -> str:
        if not self.omitted:
            return ""
        if len(self.omitted) == 1:
            return f" {self.omitted[0]} is left out: it teaches less than it costs."
        names = " and ".join(self.omitted)
        return f" {names} are left out: they teach less than they cost."


def place(
    experiment: Experiment,
    places: Places,
    *,
    search: Search | None = None,
    estimator: Estimator | None = None,
    about: Sequence[str] | None = None,
    nominal: Mapping[str, float] | None = None,
    forbidden: Sequence[tuple[Recorded, Recorded]] = (),
    least_distance: float = 0.0,
    cost: Mapping[str, float] | None = None,
    key: int | Key = 0,
    executor: Executor | None = None,
    store: str | Path | None = None,
    progress: Progress = no_progress,
) -> Placement:
    """Find where some sensors and actuators tell most about the parameters, Eq. (34).

    Transducers that are not named stay where they are: those are mounted already. Those that
    differ in their name only are exchangeable, and not tried twice.

    Parameters
    ----------
    experiment
        The experiment; each transducer that is moved keeps its tolerance.
    places
        By the name of the transducer: a list of recorded positions [m] or supports to try, or one
        support, in all of which `design.Evolutionary` searches.
    search
        `design.Exhaustive()` by default, `design.Sequential()`, `design.Forward()` or
        `design.Evolutionary()`.
    estimator, about, nominal, key, executor, store, progress
        See `information_map`.
    forbidden
        Regions in which nothing may be recorded: low and high corner [m].
    least_distance
        Least distance [m] between sensors, and between actuators.
    cost
        What a transducer must teach to be worth its place [nat], by name. What has a cost may be
        left out; the best placement is the one that teaches most less what it costs. All others
        are always placed. Kernels in the space of the outputs (`information.KDE`) blur more the
        more sensors there are, so that it finds rather too few worth their cost; take
        `information.ExpectedGain()` where sensors are counted.

    Raises
    ------
    ValueError
        If no placement is allowed, none tells anything, or the estimator cannot treat the
        experiment.
    """
    own = KDE() if estimator is None else estimator
    how = Exhaustive() if search is None else search
    rules = Rules(tuple(forbidden), float(least_distance))
    asked, given = only_about(experiment, about, nominal)
    evaluation = Evaluation(asked, own, integer_seed(key), given, executor, store, CHUNK, progress)
    offer = Offer(
        evaluation, places, rules, {name: float(each) for name, each in (cost or {}).items()}
    ).checked()
    tried = how.tried(offer)
    progress(1.0)
    return _best(offer, _distinct(tried), type(how).__name__)


def _distinct(tried: Tried) -> Tried:
    """Each placement once."""
    rows = [
        tuple((name, *np.ravel(at).tolist()) for name, at in one.items()) for one in tried.places
    ]
    first = sorted({row: number for number, row in reversed(list(enumerate(rows)))}.values())
    places = [tried.places[number] for number in first]
    return Tried(places, tried.found[first], tried.like_best[first], tried.evaluations)


def _best(offer: Offer, tried: Tried, search: str) -> Placement:
    costs = np.array([offer.price(list(one)) for one in tried.places])
    net = tried.found - costs[:, None]
    order = np.argsort(-net[:, 0], kind="stable")
    best = order[0]
    if np.isneginf(net[best, 0]):
        raise InfeasibleError(nothing_told(len(order)))
    others = [number for number in order[1:] if not (tried.like_best[[best, number]]).all()]
    difference, error = ahead(net[best], net[others[0]]) if others else (np.inf, np.nan)
    table = pd.DataFrame([_row(tried.places[number]) for number in order])
    table["information_gain"], table["information_gain_se"] = (
        tried.found[order, 0],
        spread(tried.found[order, 1:]),
    )
    table["cost"], table["net_gain"] = costs[order], net[order, 0]
    return Placement(
        positions=tried.places[best],
        omitted=tuple(name for name in offer.places if name not in tried.places[best]),
        information_gain=float(tried.found[best, 0]),
        information_gain_se=float(spread(tried.found[best, 1:])),
        cost=float(costs[best]),
        lead=difference,
        lead_se=error,
        table=table,
        search=search,
        evaluations=tried.evaluations,
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
