"""Laws fitted at many places at once, from draws of their priors."""

from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from ...inference.engines.levenberg_marquardt import minimise
from ...laws.rows import NUMBERS
from ._asked import LARGEST, NETWORK, OF_ROW, PLACE, LawsAsked, Networks, draws
from ._free_law import OfPoints, Points
from ._rational_starts import rational_starts

DRAWS = 64
"""Draws of the numbers of each law from its prior."""

OfStarts = Float[np.ndarray, "place start"]
Fitted: TypeAlias = tuple[Float[np.ndarray, "place start coordinate"], OfStarts, OfStarts]
"""Coordinates of laws, their costs and log evidence."""


def laws_at_places(objective: LawsAsked, which: Networks, places: int, starts: int) -> Fitted:
    """Laws fitted at each place, their costs and log evidence.

    `which` are numbers of the networks. `starts` are draws of the prior that are followed at each
    place, those that fit best: so many of each network; or of all networks together, where it is
    negative.
    """
    measured = rational_starts(objective, which, places)
    points = np.stack(
        [_starts(objective, which, place, starts, measured[place]) for place in range(places)]
    )
    ends, normal = minimise(objective, points.reshape(-1, OF_ROW), steps=15, largest=LARGEST)
    evidence = normal.log_evidence + objective.asked.log_volume[ends[:, PLACE].astype(int)]
    evidence = np.nan_to_num(evidence, nan=-np.inf)
    shape = points.shape[:2]
    return ends.reshape(points.shape), normal.cost.reshape(shape), evidence.reshape(shape)


def _starts(
    objective: LawsAsked, which: Networks, place: int, starts: int, measured: np.ndarray
) -> Points:
    """The best of the draws, and of the rows that follow from the law as measured."""
    costs = objective.costs_of_draws(which, DRAWS, place)
    rows = np.zeros((*costs.shape, OF_ROW))
    rows[..., :NUMBERS] = draws(DRAWS)
    rows[..., NETWORK], rows[..., PLACE] = which[:, None], place
    rows = np.concatenate([rows, measured[:, None]], axis=1)
    costs = np.concatenate([costs, _costs(objective, measured)[:, None]], axis=1)
    return best_starts(rows, costs, starts)


def best_starts(rows: np.ndarray, costs: np.ndarray, starts: int) -> Points:
    """The rows [network, draw, coordinate] of the least cost, see `laws_at_places`."""
    if starts < 0:
        rows, costs = rows.reshape(1, -1, rows.shape[-1]), costs.reshape(1, -1)
    best = np.argsort(costs, axis=1)[:, : abs(starts), None]
    return np.take_along_axis(rows, best, axis=1).reshape(-1, rows.shape[-1])


def _costs(objective: LawsAsked, rows: Points) -> OfPoints:
    known = np.isfinite(rows).all(axis=1)
    cost = np.full(len(rows), np.inf)
    cost[known] = np.nan_to_num(objective.cost(rows[known]), nan=np.inf)
    return cost
