"""Laws at places read off as quotients of polynomials: starts that no draw would hit.

A resonance without damping is as narrow as a line; a descent from beside it does not find it.
"""

import numpy as np
from jaxtyping import Float

from ...laws.rows import ELEMENTS_OF_ROW, LOGARITHM, NetworkRows, rational
from ._asked import LARGEST, NETWORK, OF_ROW, PLACE, LawsAsked, Networks
from ._free_law import over


def rational_starts(
    objective: LawsAsked, which: Networks, places: int
) -> Float[np.ndarray, "place network coordinate"]:
    """Rows of laws, `which` are numbers of their networks; NaN where one cannot be read off."""
    found = np.full((places, len(which), OF_ROW), np.nan)
    if not isinstance(objective.rows, NetworkRows):
        return found
    rows, asked = objective.rows, objective.asked
    strength, weight = -over(asked.pull, asked.information), np.sqrt(asked.information)
    s = 1j * objective.omega / rows.middle
    for column, number in enumerate(which):
        network = rational(rows.trees[number])
        if network is None:
            continue
        logs = network.numbers(strength, asked.receptance, weight, s, objective.is_cut)
        sizes = np.zeros((places, ELEMENTS_OF_ROW))
        sizes[:, : network.elements] = (logs - np.log(rows.size)) / LOGARITHM
        found[:, column] = 0.0
        found[:, column, :ELEMENTS_OF_ROW] = np.clip(sizes, -LARGEST[0], LARGEST[0])
        found[:, column, NETWORK], found[:, column, PLACE] = number, np.arange(places)
    return found
