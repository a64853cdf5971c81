"""The placement of sensors and actuators with the greatest information gain."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from .._shared.arguments import arguments_checked
from .._shared.dimensions import Key
from .._shared.garbage import long_computation
from .._shared.progress import Progress, shown
from .._shared.reprs import notebook_html
from ..experiment.experiment import Experiment
from ..positions.bounds import position_text
from ..positions.vectors import Recorded
from ._candidates import Recordings
from .information.estimator import Estimator, jackknife_error
from .maps import SIGNIFICANT, difference_of, ranked
from .running.evaluation import MOST_LINES, Evaluation, words_on_lines
from .search import Exhaustive, Search, Trials
from .search._search_space import PlacementRules, Places, SearchSpace

SHOWN = 10
"""Placements, at most, that a notebook shows."""

LEAST_LEAD = 0.01
"""Share of the information gain below which a lead is not significant, whatever its error."""


@dataclass(frozen=True, repr=False)
class Placement:
    """The best placement that was tried, and the others.

    Parameters
    ----------
    positions
        Recorded position of each transducer that is placed [m], by name.
    omitted
        Names of the transducers that are not worth their cost.
    information_gain, information_gain_se
        Information gain of the best placement, and its standard error [nat].
    cost
        Cost of the transducers that are placed [nat].
    lead, lead_se
        Net gain less that of the second best placement, and its standard error [nat]; common errors
        cancel. Placements next to the best one in a region do not count as second best.
    table
        All placements, one a row, the best first: positions [m], `information_gain`,
        `information_gain_se`, `cost` and `net_gain`, the information gain less the cost [nat].
    search
        Name of the search strategy.
    evaluations
        Number of placements whose information gain was estimated.
    lines
        Which lines were used, in words; empty where all were.

    Examples
    --------
    >>> float(best.positions["s1"]), best.evaluations
    (0.2, 2)
    """

    positions: Recordings
    omitted: tuple[str, ...]
    information_gain: float
    information_gain_se: float
    cost: float
    lead: float
    lead_se: float
    table: pd.DataFrame
    search: str
    evaluations: int
    lines: str = ""

    @property
    def net_gain(self) -> float:
        """Information gain less the cost [nat]."""
        return self.information_gain - self.cost

    def __repr__(self) -> str:
        """State the positions."""
        return f"Placement: {self}"

    def _repr_html_(self) -> str:
        return notebook_html(str(self), self.table.head(SHOWN))

    def __str__(self) -> str:
        """State the positions, the information gain and its errors."""
        where = ", ".join(
            f"{name} at {position_text(np.round(at, 4))} m" for name, at in self.positions.items()
        )
        cost = f", less {self.cost:.3g} nat of cost" if self.cost else ""
        return (
            f"Best of {len(self.table)} placements: {where or 'nothing placed'}; "
            f"{self.information_gain:.3g} ± {self.information_gain_se:.2g} nat{cost}"
            f"{self._lead_in_words()}.{self._omitted_in_words()}{self.lines and f' {self.lines}'}"
        )

    def _lead_in_words(self) -> str:
        if not np.isfinite(self.lead):
            return ""
        least = max(SIGNIFICANT * self.lead_se, LEAST_LEAD * abs(self.information_gain))
        doubt = "" if self.lead > least else ", which is not significant"
        return f", {self.lead:.2g} ± {self.lead_se:.2g} more than the second best{doubt}"

    def _omitted_in_words(self) -> str:
        if not self.omitted:
            return ""
        if len(self.omitted) == 1:
            return f" {self.omitted[0]} is left out: its information gain is less than its cost."
        names = " and ".join(self.omitted)
        return f" {names} are left out: their information gain is less than their cost."


@arguments_checked
@long_computation()
def place(
    experiment: Experiment,
    places: Places,
    *,
    search: Search | None = None,
    forbidden: Sequence[tuple[Recorded, Recorded]] = (),
    least_distance: float | None = None,
    cost: Mapping[str, float] | None = None,
    estimator: Estimator | None = None,
    about: Sequence[str] | None = None,
    nominal: Mapping[str, float] | None = None,
    key: int | Key = 0,
    lines: int | None = MOST_LINES,
    executor: Executor | None = None,
    store: str | Path | None = None,
    progress: Progress | None = None,
) -> Placement:
    """Find the positions of sensors and actuators with the greatest information gain, Eq. (34).

    Transducers that are not named are mounted already and stay. Those that differ only in their
    name are exchangeable, and not tried twice.

    Parameters
    ----------
    experiment
        The experiment; each transducer that is moved keeps its tolerance.
    places
        By the name of the transducer: a list of recorded positions [m] or tolerance regions to
        try, or one region, in all of which `design.Evolutionary` searches.
    search
        `design.Exhaustive()` by default, `design.Sequential()`, `design.Forward()` or
        `design.Evolutionary()`.
    forbidden
        Regions in which nothing may be recorded: low and high corner [m].
    least_distance
        Least distance [m] between sensors, and between actuators; by default 1 % of the greatest
        extent of the structure, which a sensor and an actuator keep at any rate, so that no two
        share a point. 0 permits that. Those that are mounted stay, however close.
    cost
        Information gain that a transducer must add to be worth its place [nat], by name. A
        transducer with a cost may be left out; the best placement is that of the greatest net
        gain. All others are always placed. Kernels in the space of the outputs
        (`information.KernelGain`) blur more with more sensors, so that rather too few seem
        worth their cost; take `information.ExpectedGain()` where sensors are counted.
    estimator, about, nominal, key, lines, executor, store, progress
        See `information_map`.

    Returns
    -------
    Placement
        Best positions, their information gain [nat] with its lead, and the table of all placements.

    Raises
    ------
    InputError
        If no placement is allowed, none has a finite information gain, or the estimator cannot
        treat the experiment.

    Examples
    --------
    >>> best = bp.place(experiment, {"s1": [0.2, 0.3, 0.4]}, estimator=estimator)
    >>> float(best.positions["s1"])
    0.2
    """
    rules = PlacementRules(tuple(forbidden), least_distance)
    costs = {name: float(nat) for name, nat in (cost or {}).items()}
    with shown(progress, "place") as report:
        evaluation = Evaluation.of(
            experiment,
            estimator=estimator,
            about=about,
            nominal=nominal,
            key=key,
            lines=lines,
            executor=executor,
            store=store,
            progress=report,
        )
        space = SearchSpace(evaluation, places, rules, costs).checked()
        best = _best(space, Exhaustive() if search is None else search)
        report(1.0)
    return replace(best, lines=words_on_lines(experiment, evaluation.experiment))


def _best(space: SearchSpace, search: Search) -> Placement:
    trials = search.trials(space).distinct()
    costs = np.array([space.price(list(positions)) for positions in trials.positions])
    net = trials.gain - costs[:, None]
    order = ranked(net[:, 0])
    best = order[0]
    lead, lead_se = _lead_over_second(trials, net, order)
    error = jackknife_error(trials.gain[:, 1:])
    table = pd.DataFrame([_row(trials.positions[number]) for number in order])
    table["information_gain"] = trials.gain[order, 0]
    table["information_gain_se"] = error[order]
    table["cost"], table["net_gain"] = costs[order], net[order, 0]
    return Placement(
        positions=trials.positions[best],
        omitted=tuple(name for name in space.places if name not in trials.positions[best]),
        information_gain=float(trials.gain[best, 0]),
        information_gain_se=float(error[best]),
        cost=float(costs[best]),
        lead=lead,
        lead_se=lead_se,
        table=table,
        search=type(search).__name__,
        evaluations=trials.evaluations,
    )


def _lead_over_second(trials: Trials, net: np.ndarray, order: np.ndarray) -> tuple[float, float]:
    """Lead of the best over the best that is not next to it; infinite if there is none."""
    best = order[0]
    for second in order[1:]:
        if not trials.near_best[[best, second]].all():
            return difference_of(net[best], net[second])
    return np.inf, np.nan


def _row(positions: Recordings) -> dict[str, float]:
    """Coordinates of each transducer."""
    row: dict[str, float] = {}
    for name, at in positions.items():
        row |= zip(position_columns(name, at), map(float, np.ravel(at)), strict=True)
    return row


def position_columns(name: str, at: Recorded | np.ndarray) -> list[str]:
    """Columns with the position of a transducer, in a table of placements."""
    return [name] if np.ndim(at) == 0 else [f"{name}.{axis}" for axis in "xyz"]
