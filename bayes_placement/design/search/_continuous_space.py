"""Regions that transducers are moved through, and placements as shares of their sides."""

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
from ..running.evaluation import Evaluation
from ._search_space import Group, gain_in_one_shape
from .placement_rules import PlacementRules
from .strategy import Trials, recorded


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


SCATTERED = 4096
"""Quasi-random placements, of which the first allowed ones are tried."""


class ContinuousSpace(NamedTuple):
    """Placements [placement, side] in shares of the sides of all regions."""

    experiment: Experiment
    """The experiment with the transducers that are placed or mounted."""
    regions: Sequence[SearchRegion]
    """Region of each transducer that is placed."""
    groups: Sequence[Group]
    """Groups of exchangeable transducers."""
    rules: PlacementRules
    """Rules for the placements."""

    def by_region(self, shares: np.ndarray) -> list[np.ndarray]:
        """Shares of each region [placement, side]."""
        ends = np.cumsum([len(region.sides) for region in self.regions])
        return np.split(shares, ends[:-1], axis=1)

    def allowed(self, shares: np.ndarray) -> np.ndarray:
        """Which placements keep to the rules and to the regions [placement]."""
        pairs = zip(self.regions, self.by_region(shares), strict=True)
        positions = {region.name: region.points(region_shares) for region, region_shares in pairs}
        inside = np.all((shares >= 0) & (shares <= 1), axis=1)
        return inside & self.rules.allowed(self.experiment, positions)

    def scattered(self, random: np.random.Generator, count: int) -> np.ndarray:
        """`count` allowed placements scattered over the regions; none if none is allowed."""
        from scipy.stats import qmc  # it takes long to import

        sides = sum(len(region.sides) for region in self.regions)
        shares = qmc.Sobol(sides, rng=random).random(SCATTERED)
        scattered = shares[self.allowed(shares)]
        if len(scattered) < count:
            resampled = [
                random.choice(region_shares, SCATTERED)
                for region_shares in self._outside_forbidden(shares)
                if len(region_shares)
            ]
            complete = len(resampled) == len(self.regions)
            shares = np.concatenate(resampled, axis=1) if complete else shares[:0]
            scattered = np.concatenate([scattered, shares[self.allowed(shares)]])
        return self.sorted(np.resize(scattered, (count if len(scattered) else 0, sides)))

    def _outside_forbidden(self, shares: np.ndarray) -> list[np.ndarray]:
        """Shares of places in each region that lie in no forbidden region."""
        pairs = zip(self.regions, self.by_region(shares), strict=True)
        return [
            region_shares[~self.rules.in_forbidden(region.points(region_shares))]
            for region, region_shares in pairs
        ]

    def sorted(self, shares: np.ndarray) -> np.ndarray:
        """Placements with exchangeable transducers in the order of their shares."""
        columns = self.by_region(shares)
        number = {region.name: place for place, region in enumerate(self.regions)}
        for group in self.groups:
            exchangeable = [number[name] for name in group if name in number]
            if len(exchangeable) < 2:
                continue
            together = np.stack([columns[place] for place in exchangeable], axis=1)
            order = np.lexsort(np.moveaxis(together, -1, 0)[::-1], axis=1)
            ordered = np.take_along_axis(together, order[..., None], axis=1)
            for place, column in zip(exchangeable, np.moveaxis(ordered, 1, 0), strict=True):
                columns[place] = column
        return np.concatenate(columns, axis=1)

    def trials(self, evaluation: Evaluation, shares: np.ndarray) -> Trials:
        """Try placements."""
        moved = [
            region.candidates(self.experiment, region_shares)
            for region, region_shares in zip(self.regions, self.by_region(shares), strict=True)
        ]
        cells = np.repeat(np.arange(len(shares))[:, None], len(moved), axis=1)
        gain = gain_in_one_shape(evaluation, moved, cells, len(shares))
        return Trials.of(recorded(moved, cells), gain)
