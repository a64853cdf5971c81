"""Laws of few numbers at many places where amplitudes alone were measured.

A law that is free at each line has two unknowns there, and an amplitude is one equation. So laws of
few numbers are fitted at once, all other unknowns with them, and nothing is linearised.
"""

import numpy as np
from jaxtyping import Float

from ...inference.engines.levenberg_marquardt import minimise
from ._asked import Networks, draws
from ._free_law import Points
from ._laws_at_places import Fitted, best_starts
from ._laws_in_full import LawsInFull

DRAWS = 16
"""Draws of the numbers of each law from its prior: each is a response of the structure."""

STEPS = 12
"""Steps of descents, which say which laws and places are best."""


def laws_of_amplitudes(
    objective: LawsInFull, which: Networks, points: Points, starts: int
) -> Fitted:
    """Laws fitted from points, their costs and log evidence.

    Places are held; points are coordinates of the problem, each of a place. `which` are numbers of
    the networks, `starts` draws of the prior that are followed at each, see `laws_at_places`.
    """
    begins = np.concatenate([_starts(objective, which, point, starts) for point in points])
    ends, normal = minimise(objective, begins, steps=STEPS, largest=objective.largest)
    evidence = np.nan_to_num(normal.log_evidence, nan=-np.inf)
    shape = len(points), -1
    return ends.reshape(*shape, ends.shape[1]), normal.cost.reshape(shape), evidence.reshape(shape)


def _starts(
    objective: LawsInFull, which: Networks, point: Float[np.ndarray, "coordinate"], starts: int
) -> Points:
    numbers = np.broadcast_to(draws(DRAWS), (len(which), *draws(DRAWS).shape))
    alike = (*numbers.shape[:2], len(point))
    networks = np.broadcast_to(which[:, None, None], (*numbers.shape[:2], 1))
    rows = np.concatenate([np.broadcast_to(point, alike), numbers, networks], axis=2)
    costs = objective.cost(rows.reshape(-1, rows.shape[-1])).reshape(numbers.shape[:2])
    return best_starts(rows, np.nan_to_num(costs, nan=np.inf), starts)
