"""evolutionary: in, regions; out, placements bred by the evolution of several populations.

Not known here: how information is estimated.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import cmaes
import equinox as eqx
import numpy as np

from .._types import InfeasibleError
from ..experiment import Experiment
from ._candidates import Candidates
from ._evaluation import Evaluation
from ._offer import Crew, Offer, at_places, part
from ._regions import Region, region
from ._rules import Rules
from .search import Search, Tried, nothing, of_each_crew, recorded

WIDTH = 0.25
"""Standard deviation of the first generation, as a share of each side of a region."""

NEAR = 0.1
"""Share of each side of a region within which a placement is taken as a neighbour of the best."""

SCATTERED = 4096
"""Places among which the first middles of populations are chosen."""

TRIES = 20
"""How often a generation is drawn anew where rules leave too few of it."""


class Evolutionary(Search):
    """Anywhere in regions, by evolution strategies with adapted covariance (CMA-ES).

    Hansen (2016, arXiv 1604.00772), by the library `cmaes`. Several populations, which begin far
    from each other, look for several maxima, such as mirror images; one that has come to rest
    begins anew far from all others, until each has come to rest once. What rules forbid is drawn
    again, so no placement that is tried breaks them. A generation of all populations is computed
    at once.

    Parameters
    ----------
    populations
        Populations.
    size
        Placements of each population in a generation.
    generations
        Generations, at most.
    accuracy
        Share of the sides of its region to which a population narrows down before it rests.
    """

    populations: int = eqx.field(static=True, default=4)
    size: int = eqx.field(static=True, default=8)
    generations: int = eqx.field(static=True, default=100)
    accuracy: float = eqx.field(static=True, default=0.01)

    def __check_init__(self) -> None:
        if min(self.populations, self.generations) < 1 or self.size < 4 or not self.accuracy > 0:
            raise ValueError(
                f"Evolutionary(populations={self.populations}, size={self.size}, "
                f"generations={self.generations}, accuracy={self.accuracy:g}) was given; at least "
                "one population of four, one generation, and a positive accuracy are needed: "
                "Evolutionary(populations=4, size=8)."
            )

    def tried(self, offer: Offer) -> Tried:
        """Try placements bred from the best ones.

        Raises
        ------
        ValueError
            If none is allowed, or a transducer was given no region.
        """
        regions = [region(offer.experiment, *given) for given in offer.places.items()]
        groups = offer.groups([_some(offer.experiment, one) for one in regions])

        def bred(here: Evaluation, crew: Crew) -> Tried:
            there = [one for one in regions if one.name in crew]
            space = _Space(here.experiment, there, groups, offer.rules)
            return self._bred(here._replace(chunk=self.size), space)

        return of_each_crew(offer, groups, bred)

    def _bred(self, here: Evaluation, space: "_Space") -> Tried:
        random = np.random.default_rng(here.seed)
        scattered = space.scattered(random)
        if not len(scattered):
            return nothing(here)
        found = list(self._generations(here, space, scattered, random))
        share = np.concatenate([share for share, _ in found])
        learnt = np.concatenate([one.found for _, one in found])
        near = np.abs(share - share[np.argmax(learnt[:, 0])]).max(axis=1) < NEAR
        return Tried.joined([one for _, one in found])._replace(like_best=near)

    def _generations(
        self,
        here: Evaluation,
        space: "_Space",
        scattered: np.ndarray,
        random: np.random.Generator,
    ) -> Iterator[tuple[np.ndarray, Tried]]:
        begun: list[np.ndarray] = []

        def begin() -> cmaes.CMA:
            begun.append(_far_from(begun, scattered, random))
            seed = int(random.integers(2**31))
            return cmaes.CMA(begun[-1], WIDTH, seed=seed, population_size=self.size)

        several = [begin() for _ in range(self.populations)]
        rested = np.zeros(self.populations, dtype=bool)
        for number in range(self.generations):
            drawn = [_drawn(one, space, scattered, random) for one in several]
            whole = space.sorted(np.concatenate(drawn))
            tried = space.learnt(part(here, number, self.generations), whole)
            yield whole, tried
            values = np.split(-tried.found[:, 0], self.populations)
            for place, (one, share, value) in enumerate(zip(several, drawn, values, strict=True)):
                one.tell(list(zip(share, value, strict=True)))
                if np.ptp(share, axis=0).max() < self.accuracy or one.should_stop():
                    begun.append(one.mean)
                    rested[place], several[place] = True, begin()
            if rested.all():
                return


class _Space(NamedTuple):
    """Shares of the sides of all regions, one behind the other.

    Parameters
    ----------
    experiment
        The experiment with those that are there.
    regions
        Where each may be placed.
    groups
        Names of those that can be exchanged.
    rules
        What a placement must keep to.
    """

    experiment: Experiment
    regions: Sequence[Region]
    groups: Sequence[Crew]
    rules: Rules

    def of_each(self, share: np.ndarray) -> list[np.ndarray]:
        """Shares of each region [placement, side]."""
        ends = np.cumsum([len(one.sides) for one in self.regions])
        return np.split(share, ends[:-1], axis=1)

    def allowed(self, share: np.ndarray) -> np.ndarray:
        """Which placements keep to the rules and to the regions."""
        pairs = zip(self.regions, self.of_each(share), strict=True)
        where = {one.name: one.points(own) for one, own in pairs}
        inside = np.all((share >= 0) & (share <= 1), axis=1)
        return inside & self.rules.allowed(self.experiment, where)

    def scattered(self, random: np.random.Generator) -> np.ndarray:
        """Placements all over the regions that are allowed."""
        sides = sum(len(one.sides) for one in self.regions)
        share = random.uniform(size=(SCATTERED, sides))
        return share[self.allowed(share)]

    def sorted(self, share: np.ndarray) -> np.ndarray:
        """Placements with those that can be exchanged in the order of their shares."""
        each = self.of_each(share)
        number = {one.name: place for place, one in enumerate(self.regions)}
        for group in self.groups:
            own = [number[name] for name in group if name in number]
            if len(own) < 2:
                continue
            together = np.stack([each[place] for place in own], axis=1)
            order = np.lexsort(np.moveaxis(together, -1, 0)[::-1], axis=1)
            ordered = np.take_along_axis(together, order[..., None], axis=1)
            for place, column in zip(own, np.moveaxis(ordered, 1, 0), strict=True):
                each[place] = column
        return np.concatenate(each, axis=1)

    def learnt(self, here: Evaluation, share: np.ndarray) -> Tried:
        """Information at placements.

        Raises
        ------
        InfeasibleError
            If each place would be compiled by itself.
        """
        several = [
            one.candidates(self.experiment, own)
            for one, own in zip(self.regions, self.of_each(share), strict=True)
        ]
        for one in several:
            if one.kinds().max() > len(share) // 2:
                raise InfeasibleError(
                    f'The tolerance of "{one.name}" is a law of another form at each place, which '
                    "would be compiled by itself; one that differs in numbers only is needed. "
                    "Declare at=supports.Box(...), or search a list of places by "
                    "search=design.Exhaustive()."
                )
        cells = np.repeat(np.arange(len(share))[:, None], len(several), axis=1)
        return Tried.of(recorded(several, cells), at_places(here, several, cells, len(share)))


def _some(experiment: Experiment, one: Region) -> Candidates:
    """Some places of a region."""
    share = np.linspace(0.3, 0.7, 3)[:, None] * np.ones(len(one.sides))
    return one.candidates(experiment, share)


def _far_from(
    others: Sequence[np.ndarray], scattered: np.ndarray, random: np.random.Generator
) -> np.ndarray:
    """Choose the placement that is farthest from others."""
    if not others:
        return scattered[random.integers(len(scattered))]
    steps = scattered[:, None] - np.stack(others)
    return scattered[np.argmax(np.linalg.norm(steps, axis=-1).min(axis=1))]


def _drawn(
    population: cmaes.CMA, space: _Space, scattered: np.ndarray, random: np.random.Generator
) -> np.ndarray:
    """Draw a generation that keeps to the rules; drawn from everywhere if it can hardly do so."""
    size = population.population_size
    found = np.zeros((0, scattered.shape[1]))
    for _ in range(TRIES):
        drawn = np.stack([population.ask() for _ in range(size)])
        found = np.concatenate([found, drawn[space.allowed(drawn)]])
        if len(found) >= size:
            return found[:size]
    return np.concatenate([found, random.choice(scattered, size - len(found))])
