"""One kind of port on one piece: what any law could remove at each place, then laws with names."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ...experiment.resized import evenly_spread
from ...inference.engines.levenberg_marquardt import Fit, best_fit, minimise
from ...inference.residuals import Problem, point_in_problem
from ...laws.law import Law, Tree
from ...laws.rows import NUMBERS, Rows
from ._asked import LARGEST, NETWORK, OF_ROW, PLACE, Asked, LawsAsked, draws
from ._free_law import AnyLaw, FreeLaw, Points
from ._laws_in_full import LawsInFull
from ._ports import Port, grid, largest, place_columns

MOST_LINES, MOST_LINES_AT_BEST = 128, 400
"""Lines at which laws are fitted at all places, and at the best few: these are starts only."""

DRAWS, STARTS, FOLLOWED = 64, 2, 8
"""Draws of the numbers of each law from its prior, the best of these that are followed, and those
of all laws together where they are to say what a place can do."""

BEST_PLACES = 3
"""Places of a kind of port at which every network is fitted."""

BEST_LAWS = 6
"""Laws of a kind of port that are fitted in full, with their places and all other unknowns."""


Point = Float[np.ndarray, "unknown"]
"""Coordinates of a problem."""


class NamedLaw(NamedTuple):
    """A network at a port, fitted in full.

    Parameters
    ----------
    port
        The kind of port.
    tree
        The network.
    law
        The network with its numbers.
    prior
        The network with priors of its numbers.
    point
        Coordinates of the problem, the place among them.
    numbers
        Coordinates of the numbers of the law.
    fit
        Its fit: mode, squares, evidence.
    """

    port: Port
    tree: Tree
    law: Law
    prior: Law
    point: Float[np.ndarray, "unknown"]
    numbers: Float[np.ndarray, "number"]
    fit: Fit


class ReachOfPort(NamedTuple):
    """What laws at a kind of port can do, by place.

    Parameters
    ----------
    port
        The kind of port.
    free
        The problem with a law that may be any.
    points
        Fits with the law free at each line [place, unknown].
    squares
        Their sums of squares.
    log_evidence
        Log evidence of the best law of a few numbers at each place.
    """

    port: Port
    free: FreeLaw
    points: Points
    squares: Float[np.ndarray, "place"]
    log_evidence: Float[np.ndarray, "place"]

    def rows(self) -> Rows:
        """The networks of the kind of port."""
        return _rows(self.port, self.free)


def reach_of_port(base: Problem, point: Point, port: Port) -> ReachOfPort:
    """Fit all else at each place with a free law, then laws of a few numbers there.

    Parameters
    ----------
    base
        The problem of the model.
    point
        Its fit.
    port
        The kind of port.
    """
    problem = base.with_effect(port.effect)
    columns = place_columns(port, problem)
    free = FreeLaw(problem, columns)
    start = point_in_problem(base, point, problem)
    ends, squares = _with_free_law(start, free, grid(port, len(columns)))
    rows = _rows(port, free)
    which = np.array(largest(rows.trees))
    objective = _objective(free, ends, rows, port, MOST_LINES)
    _, evidence = _laws(objective, which, len(ends), -FOLLOWED)
    return ReachOfPort(port, free, ends, squares, evidence.max(axis=1))


def laws_with_names(reach: ReachOfPort) -> list[NamedLaw]:
    """Every network at the best few places; the best of them in full, with their places.

    Parameters
    ----------
    reach
        What laws can do at each place.
    """
    port, free, rows = reach.port, reach.free, reach.rows()
    chosen = np.argsort(-reach.log_evidence)[:BEST_PLACES]
    points = reach.points[chosen]
    objective = _objective(free, points, rows, port, MOST_LINES_AT_BEST)
    fits, evidence = _laws(objective, np.arange(len(rows.trees)), len(chosen), STARTS)
    fits = fits.reshape(-1, OF_ROW)
    best: dict[int, Any] = {}  # of each network
    for row in fits[np.argsort(-evidence.ravel())]:
        best.setdefault(int(row[NETWORK]), row)
    starts = [
        np.concatenate([points[int(row[PLACE])], row[:NUMBERS], [row[NETWORK]]])
        for row in [*best.values()][:BEST_LAWS]
    ]
    return _in_full(reach, rows, np.array(starts))


def _in_full(reach: ReachOfPort, rows: Rows, starts: Any) -> list[NamedLaw]:
    free = FreeLaw(reach.free.problem)
    objective = LawsInFull(free, rows, _omega(free), reach.port.is_cut)
    ends, normal = minimise(objective, starts, steps=25, largest=objective.largest)
    named = []
    for row in range(len(ends)):
        here = type(normal)(*(values[row : row + 1] for values in normal))
        inner = here._replace(gradient=here.gradient[:, :-1], curvature=here.curvature[:, :-1, :-1])
        fit = best_fit(ends[row : row + 1, :-1], inner, free.problem.count)
        network, size = int(ends[row, -1]), free.problem.dimension
        numbers = ends[row, size:-1]
        law = rows.law(network, numbers)
        named.append(
            NamedLaw(
                reach.port,
                rows.trees[network],
                law,
                rows.prior(network),
                ends[row, :size],
                numbers,
                fit,
            )
        )
    return named


def _with_free_law(start: Point, free: FreeLaw, places: Any) -> tuple[Points, Any]:
    """All else fitted at each place, from the fit without a law and from the medians of priors."""
    fitted = np.repeat(start[None], len(places), axis=0)
    starts = np.concatenate([fitted, np.zeros_like(fitted)])
    starts[:, free.held] = np.concatenate([places, places])
    ends, normal = minimise(AnyLaw(free), starts, steps=12)
    costs = np.nan_to_num(normal.cost, nan=np.inf).reshape(2, -1)
    best, numbers = np.argmin(costs, axis=0), np.arange(len(places))
    chosen = best * len(places) + numbers
    return ends[chosen], normal.squares[chosen]


def _laws(objective: LawsAsked, which: Any, places: int, starts: int) -> Any:
    """Laws fitted at each place, and the log evidence of each [place, start].

    Starts are those draws of the prior that fit best, so many of each network at each place; or of
    all networks together, where `starts` is negative.
    """
    points = np.stack([_starts(objective, which, place, starts) for place in range(places)])
    ends, normal = minimise(objective, points.reshape(-1, OF_ROW), steps=15, largest=LARGEST)
    curved = np.linalg.slogdet(normal.curvature)[1]
    evidence = -normal.cost - 0.5 * curved + objective.asked.log_volume[ends[:, PLACE].astype(int)]
    evidence = np.nan_to_num(evidence, nan=-np.inf)
    return ends.reshape(points.shape), evidence.reshape(points.shape[:2])


def _starts(objective: LawsAsked, which: Any, place: int, starts: int) -> Points:
    costs = objective.costs_of_draws(which, DRAWS, place)
    rows = np.zeros((*costs.shape, OF_ROW))
    rows[..., :NUMBERS] = draws(DRAWS)
    rows[..., NETWORK], rows[..., PLACE] = which[:, None], place
    if starts < 0:
        rows, costs = rows.reshape(1, -1, OF_ROW), costs.reshape(1, -1)
    best = np.argsort(costs, axis=1)[:, : abs(starts), None]
    chosen: Points = np.take_along_axis(rows, best, axis=1).reshape(-1, OF_ROW)
    return chosen


def _objective(free: FreeLaw, points: Points, rows: Rows, port: Port, most: int) -> LawsAsked:
    """Laws at places, at no more lines than are needed to choose among them."""
    omega = _omega(free)
    lines = evenly_spread(omega.size, most) if omega.size > most else np.arange(omega.size)
    return LawsAsked(Asked.at(free, points, lines), rows, omega[lines], port.is_cut)


def _rows(port: Port, free: FreeLaw) -> Rows:
    omega = _omega(free)
    size = 1 / free.size() if port.is_cut else free.size()
    return Rows(port.trees(), size, float(np.sqrt(omega[0] * omega[-1])))


def _omega(free: FreeLaw) -> Any:
    return 2 * np.pi * np.asarray(free.problem.experiment.frequency, float)
