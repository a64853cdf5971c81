"""_regions: in, a support to search in; out, the places that are at given shares of its sides.

Not known here: how information is estimated, how places are searched for.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpyro.distributions import Uniform

from ..._sites import is_unknown
from ..._types import InputError
from ...experiment.experiment import Experiment
from ...positions.bounds import in_space
from ...positions.places import Straight
from ...positions.tolerances import Segment, Tolerance
from .._candidates import Candidates, candidates, transducer


class Region(NamedTuple):
    """All places of a support.

    Parameters
    ----------
    name
        Transducer that is placed there.
    origin
        Corner of the region [m], [coordinate].
    sides
        Its sides [m], [side, coordinate].
    """

    name: str
    origin: np.ndarray
    sides: np.ndarray

    def points(self, share: np.ndarray) -> np.ndarray:
        """Places [place, coordinate] [m] at shares of the sides [place, side]."""
        return self.origin + share @ self.sides

    def candidates(self, experiment: Experiment, share: np.ndarray) -> Candidates:
        """The transducer at shares of the sides [place, side]."""
        points = self.points(share)
        places = points[:, 0] if points.shape[1] == 1 else points
        return candidates(experiment, {self.name: places})[0]


def region(experiment: Experiment, name: str, given: Any) -> Region:
    """Where a transducer may be placed.

    Parameters
    ----------
    experiment
        The experiment.
    name
        The transducer.
    given
        One support; or numbers on a line, between the least and the greatest of which it may be.

    Raises
    ------
    ValueError
        If it is nothing that one can move through.
    """
    bounds = experiment.structure.modes.bounds()
    support = given if isinstance(given, Tolerance) else _span(experiment, name, given)
    law = support.on(bounds)
    if isinstance(law, Uniform):
        low, high = float(law.low), float(law.high)
        return Region(name, np.array([low]), np.array([[high - low]]))
    if not isinstance(law, Straight):
        raise InputError(
            f"{_whose(experiment, name)} was to be moved through {type(support).__name__}; a "
            "region with straight sides is needed: positions.Segment on a line, positions.Member, "
            "Patch or Box in space."
        )
    return _straight(name, law)


def _straight(name: str, law: Straight) -> Region:
    origin, directions, values = law.frame()
    low, high = np.array(
        [
            (float(one.low), float(one.high)) if is_unknown(one) else (float(one), float(one))
            for one in values.values()
        ]
    ).T
    free = high > low
    sides = directions[free] * (high - low)[free, None]
    return Region(name, origin + low @ directions, sides)


def _span(experiment: Experiment, name: str, given: Sequence[Any] | np.ndarray) -> Tolerance:
    if not in_space(experiment.structure.modes.bounds()):
        try:
            numbers = np.asarray(given, dtype=float)
            low, high = numbers.min(), numbers.max()
            return Segment((low + high) / 2, within=(high - low) / 2)
        except (TypeError, ValueError):
            pass
    raise InputError(
        f"{_whose(experiment, name)} was given a list of places; design.Evolutionary needs a "
        "region to move it through: one support (positions.Segment on a line, positions.Member, "
        "Patch or Box in space), or several numbers on a line, between which it may be. Give "
        f'{{"{name}": positions.Segment(0.5, within=0.45)}}, or search=design.Sequential().'
    )


def _whose(experiment: Experiment, name: str) -> str:
    return f'{transducer(experiment, name).kind} "{name}"'
