"""evolutionary: in, regions; out, placements bred by the evolution of several populations.

Not known here: how information is estimated.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import cmaes
import equinox as eqx
import numpy as np
from scipy.stats import qmc

from ..._types import InfeasibleError, InputError
from ...experiment.experiment import Experiment
from .._candidates import Candidates
from ..running._evaluation import Evaluation
from ._offer import Crew, Offer, at_places, part
from ._regions import Region, region
from ._rules import Rules
from .search import Search, Tried, nothing, of_each_crew, recorded

WIDTH = 0.25
"""Greatest standard deviation with which a population begins, as a share of each side."""

NEAR = 0.1
"""Share of each side of a region within which a placement is taken as a neighbour of the best."""

SCATTERED = 4096
"""Quasi-random placements, of which the first that are allowed are tried."""

TRIES = 20
"""How often a generation is drawn anew where rules leave too few of it."""


class Evolutionary(Search):
    """Anywhere in regions, by evolution strategies with adapted covariance (CMA-ES).

    Hansen (2016, arXiv 1604.00772), by the library `cmaes`. Placements scattered evenly come first.
    Populations begin at the best of them that are far from each other, so that they find several
    maxima, such as mirror images; one that has come to rest begins anew, until each has come to
    rest once. What rules forbid is drawn again, so no placement that is tried breaks them. A
    generation of all populations is computed at once.

    Parameters
    ----------
    populations
        Populations.
    size
        Placements of each population in a generation.
    scattered
        Generations that are scattered evenly.
    generations
        Generations that are bred, at most.
    accuracy
        Share of the sides of its region to which a population narrows down before it rests.
    """

    populations: int = eqx.field(static=True, default=4)
    size: int = eqx.field(static=True, default=8)
    scattered: int = eqx.field(static=True, default=4)
    generations: int = eqx.field(static=True, default=100)
    accuracy: float = eqx.field(static=True, default=0.01)

    def __check_init__(self) -> None:
        counts = (self.populations, self.scattered, self.generations)
        if min(counts) < 1 or self.size < 4 or not self.accuracy > 0:
            raise InputError(
                f"Evolutionary(populations={self.populations}, size={self.size}, scattered="
                f"{self.scattered}, generations={self.generations}, accuracy={self.accuracy:g}) "
                "was given; at least one population of four, one generation of each kind, and a "
                "positive accuracy are needed: Evolutionary(populations=4, size=8)."
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
        even = space.scattered(random, self.scattered * self.populations * self.size)
        if not len(even):
            return nothing(here)
        found = list(self._generations(here, space, even, random))
        share = np.concatenate([share for share, _ in found])
        learnt = np.concatenate([one.found for _, one in found])
        near = np.abs(share - share[np.argmax(learnt[:, 0])]).max(axis=1) < NEAR
        return Tried.joined([one for _, one in found])._replace(like_best=near)

    def _generations(
        self, here: Evaluation, space: "_Space", even: np.ndarray, random: np.random.Generator
    ) -> Iterator[tuple[np.ndarray, Tried]]:
        """Shares of all placements of each generation, and what they teach."""
        values = []
        count = self.scattered + self.generations
        for number, share in enumerate(np.split(even, self.scattered)):
            tried = space.learnt(part(here, number, count), share)
            values.append(tried.found[:, 0])
            yield share, tried
        nursery = _Nursery(even, np.concatenate(values), random)
        several = [nursery.begin(self.size) for _ in range(self.populations)]
        rested = np.zeros(self.populations, dtype=bool)
        for number in range(self.scattered, count):
            drawn = [_drawn(one, space, even, random) for one in several]
            share = space.sorted(np.concatenate(drawn))
            tried = space.learnt(part(here, number, count), share)
            yield share, tried
            losses = np.split(_losses(tried.found[:, 0]), self.populations)
            for place, (own, loss) in enumerate(zip(drawn, losses, strict=True)):
                several[place].tell(list(zip(own, loss, strict=True)))
                if np.ptp(own, axis=0).max() < self.accuracy or several[place].should_stop():
                    rested[place] = True
                    several[place] = nursery.begin(self.size, space.sorted(own).mean(axis=0))
            if rested.all():
                return


def _losses(learnt: np.ndarray) -> np.ndarray:
    """What a population is to make small; where nothing is told, worse than anywhere else."""
    worst = np.max(-learnt, where=np.isfinite(learnt), initial=0.0) + 1.0
    return np.where(np.isfinite(learnt), -learnt, worst)


class _Nursery:
    """Where populations begin: at the best scattered placements that are far from all before."""

    def __init__(self, even: np.ndarray, values: np.ndarray, random: np.random.Generator):
        self._even, self._values, self._random = even, values, random
        self._distance = np.full(len(even), np.inf)
        self._width = min(WIDTH, len(even) ** (-1 / even.shape[1]))  # about that between them

    def begin(self, size: int, ended: np.ndarray | None = None) -> cmaes.CMA:
        """Return a new population, far from where others began and the last one ended."""
        if ended is not None:
            self._keep_off(ended)
        far = self._distance > 2 * self._width
        worth = np.where(far, self._values, -np.inf) if far.any() else self._distance
        middle = self._even[np.argmax(worth)]
        self._keep_off(middle)
        seed = int(self._random.integers(2**31))
        return cmaes.CMA(middle, self._width, seed=seed, population_size=size)

    def _keep_off(self, place: np.ndarray) -> None:
        self._distance = np.minimum(self._distance, np.abs(self._even - place).max(axis=1))


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

    def scattered(self, random: np.random.Generator, count: int) -> np.ndarray:
        """So many placements all over the regions that are allowed; none if none is."""
        sides = sum(len(one.sides) for one in self.regions)
        share = qmc.Sobol(sides, rng=random).random(SCATTERED)
        found = share[self.allowed(share)]
        if len(found) < count:
            each = [random.choice(own, SCATTERED) for own in self._alone(share) if len(own)]
            share = np.concatenate(each, axis=1) if len(each) == len(self.regions) else share[:0]
            found = np.concatenate([found, share[self.allowed(share)]])
        return self.sorted(np.resize(found, (count if len(found) else 0, sides)))

    def _alone(self, share: np.ndarray) -> list[np.ndarray]:
        """Shares of each region that are allowed as far as it alone is concerned."""
        pairs = zip(self.regions, self.of_each(share), strict=True)
        return [own[~self.rules.in_forbidden(one.points(own))] for one, own in pairs]

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
        """Information at placements."""
        several = [
            one.candidates(self.experiment, own)
            for one, own in zip(self.regions, self.of_each(share), strict=True)
        ]
        cells = np.repeat(np.arange(len(share))[:, None], len(several), axis=1)
        return Tried.of(recorded(several, cells), at_places(here, several, cells, len(share)))


def _some(experiment: Experiment, one: Region) -> Candidates:
    """Some places of a region.

    Raises
    ------
    InfeasibleError
        If each place would be compiled by itself.
    """
    share = np.linspace(0.3, 0.7, 3)[:, None] * np.ones(len(one.sides))
    several = one.candidates(experiment, share)
    if np.unique(several.kinds()).size == len(share):
        raise InfeasibleError(
            f'The tolerance of "{one.name}" is a law of another form at each place, which would be '
            "compiled by itself; one that differs in numbers only is needed. Declare "
            "at=positions.Box(...), or search a list of places by search=design.Exhaustive()."
        )
    return several


def _drawn(
    population: cmaes.CMA, space: _Space, even: np.ndarray, random: np.random.Generator
) -> np.ndarray:
    """Draw a generation that keeps to the rules; drawn from everywhere if it can hardly do so."""
    size = population.population_size
    found = np.zeros((0, even.shape[1]))
    for _ in range(TRIES):
        drawn = np.stack([population.ask() for _ in range(size)])
        found = np.concatenate([found, drawn[space.allowed(drawn)]])
        if len(found) >= size:
            return found[:size]
    return np.concatenate([found, random.choice(even, size - len(found))])
