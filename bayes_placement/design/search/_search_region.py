"""Regions that a transducer is moved through continuously, in coordinates from 0 to 1."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpyro.distributions import Uniform

from ..._shared.errors import InputError
from ..._shared.sites import is_unknown
from ...experiment.experiment import Experiment
from ...positions.bounds import in_space
from ...positions.places import Straight
from ...positions.tolerances import Segment, Tolerance
from .._candidates import Candidates, candidates, transducer


class SearchRegion(NamedTuple):
    """Region with straight sides in which a transducer is placed."""

    name: str
    """The transducer."""
    origin: np.ndarray
    """Corner of the region [coordinate] [m]."""
    sides: np.ndarray
    """Its sides [side, coordinate] [m]."""

    def points(self, shares: np.ndarray) -> np.ndarray:
        """Places [place, coordinate] [m] at shares of the sides [place, side]."""
        return self.origin + shares @ self.sides

    def candidates(self, experiment: Experiment, shares: np.ndarray) -> Candidates:
        """The transducer at shares of the sides [place, side]."""
        points = self.points(shares)
        places = points[:, 0] if points.shape[1] == 1 else points
        return candidates(experiment, {self.name: places})[0]


def search_region(experiment: Experiment, name: str, places: Any) -> SearchRegion:
    """Region in which a transducer may be placed.

    It is one region, or numbers on a line, between the least and the greatest of which it may be.
    """
    bounds = experiment.structure.modes.bounds()
    region = places if isinstance(places, Tolerance) else _between(experiment, name, places)
    position = region.on(bounds)
    if isinstance(position, Uniform):
        low, high = float(position.low), float(position.high)
        return SearchRegion(name, np.array([low]), np.array([[high - low]]))
    if not isinstance(position, Straight):
        raise InputError(
            f"{_kind_and_name(experiment, name)} was to be moved through {type(region).__name__}; "
            "a region with straight sides is needed: positions.Segment on a line, "
            "positions.Member, Patch or Box in space."
        )
    return _straight(name, position)


def _straight(name: str, position: Straight) -> SearchRegion:
    origin, directions, coordinates = position.frame()
    low, high = np.array(
        [
            (float(at.low), float(at.high)) if is_unknown(at) else (float(at), float(at))
            for at in coordinates.values()
        ]
    ).T
    free = high > low
    sides = directions[free] * (high - low)[free, None]
    return SearchRegion(name, origin + low @ directions, sides)


def _between(experiment: Experiment, name: str, places: Sequence[Any] | np.ndarray) -> Tolerance:
    """Segment between the least and the greatest number of a list."""
    if not in_space(experiment.structure.modes.bounds()):
        try:
            numbers = np.asarray(places, dtype=float)
            low, high = numbers.min(), numbers.max()
            return Segment((low + high) / 2, within=(high - low) / 2)
        except (TypeError, ValueError):
            pass
    raise InputError(
        f"{_kind_and_name(experiment, name)} was given a list of places; design.Evolutionary needs "
        "a region to move it through: one region (positions.Segment on a line, positions.Member, "
        "Patch or Box in space), or several numbers on a line, between which it may be. Give "
        f'{{"{name}": positions.Segment(0.5, within=0.45)}}, or search=design.Sequential().'
    )


def _kind_and_name(experiment: Experiment, name: str) -> str:
    return f'{transducer(experiment, name).kind} "{name}"'
