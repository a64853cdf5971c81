"""Evolutionary search (CMA-ES) for placements anywhere in regions."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import equinox as eqx
import numpy as np

from ..._shared.arguments import check_fields
from ..._shared.errors import InfeasibleError, InputError
from ...experiment.experiment import Experiment
from .._candidates import Candidates
from ..running.evaluation import Evaluation
from ._continuous_space import ContinuousSpace, SearchRegion, search_region
from ._search_space import SearchSpace, Selection
from .strategy import Search, Trials, trials_of_selections

if TYPE_CHECKING:
    import cmaes

WIDTH = 0.25
"""Greatest standard deviation with which a population begins, as a share of each side."""

NEXT_TO_BEST = 0.1
"""Share of each side of a region within which a placement is taken as next to the best."""

TRIES = 20
"""How often a generation is drawn again if the rules reject too much of it."""


class Evolutionary(Search):
    """Anywhere in regions, by evolution strategies with adapted covariance (CMA-ES).

    Hansen (2016, arXiv 1604.00772), by the library `cmaes`. Placements scattered evenly come first.
    Populations begin at the best of them that are far from each other, so that they find several
    maxima, such as mirror images; a population that has converged begins again elsewhere, until
    each has converged once. Placements that rules forbid are drawn again and never evaluated. A
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
        Generations of the evolution, at most.
    accuracy
        Share of the sides of its region within which a population has converged.

    Examples
    --------
    >>> bp.design.Evolutionary(populations=2, generations=50, accuracy=0.05)
    Evolutionary(populations=2, generations=50, accuracy=0.05)
    """

    populations: int = eqx.field(static=True, default=4)
    size: int = eqx.field(static=True, default=8)
    scattered: int = eqx.field(static=True, default=4)
    generations: int = eqx.field(static=True, default=100)
    accuracy: float = eqx.field(static=True, default=0.01)

    def __check_init__(self) -> None:
        check_fields(self)
        counts = (self.populations, self.scattered, self.generations)
        if min(counts) < 1 or self.size < 4 or not self.accuracy > 0:
            raise InputError(
                f"Evolutionary(populations={self.populations}, size={self.size}, scattered="
                f"{self.scattered}, generations={self.generations}, accuracy={self.accuracy:g}) "
                "was given; at least one population of four, one generation of each kind, and a "
                "positive accuracy are needed: Evolutionary(populations=4, size=8)."
            )

    def trials(self, space: SearchSpace) -> Trials:
        """Try placements that evolve from the best ones.

        Raises
        ------
        InputError
            If none is allowed, or a transducer was given no region.
        """
        regions = [search_region(space.experiment, *item) for item in space.places.items()]
        groups = space.groups([_examples(space.experiment, region) for region in regions])

        def evolved(evaluation: Evaluation, selection: Selection) -> Trials:
            chosen = [region for region in regions if region.name in selection]
            continuous = ContinuousSpace(evaluation.experiment, chosen, groups, space.rules)
            return self._evolved(evaluation._replace(chunk=self.size), continuous)

        return trials_of_selections(space, groups, evolved)

    def _evolved(self, evaluation: Evaluation, space: ContinuousSpace) -> Trials:
        random = np.random.default_rng(evaluation.seed)
        even = space.scattered(random, self.scattered * self.populations * self.size)
        if not len(even):
            return Trials.none(evaluation)
        generations = list(self._generations(evaluation, space, even, random))
        shares = np.concatenate([shares for shares, _ in generations])
        trials = Trials.joined([trials for _, trials in generations])
        best = shares[np.argmax(trials.gain[:, 0])]
        return trials._replace(near_best=np.abs(shares - best).max(axis=1) < NEXT_TO_BEST)

    def _generations(
        self,
        evaluation: Evaluation,
        space: ContinuousSpace,
        even: np.ndarray,
        random: np.random.Generator,
    ) -> Iterator[tuple[np.ndarray, Trials]]:
        """Shares of all placements of each generation, and their trials."""
        count = self.scattered + self.generations
        gains = []
        for number, shares in enumerate(np.split(even, self.scattered)):
            trials = space.trials(evaluation.part(number, count), shares)
            gains.append(trials.gain[:, 0])
            yield shares, trials
        starts = _Starts(even, np.concatenate(gains), random)
        populations = [starts.population(self.size) for _ in range(self.populations)]
        converged = np.zeros(self.populations, dtype=bool)
        for number in range(self.scattered, count):
            proposals = [_generation(population, space, even, random) for population in populations]
            shares = space.sorted(np.concatenate(proposals))
            trials = space.trials(evaluation.part(number, count), shares)
            yield shares, trials
            losses = np.split(_losses(trials.gain[:, 0]), self.populations)
            for place, (members, loss) in enumerate(zip(proposals, losses, strict=True)):
                populations[place].tell(list(zip(members, loss, strict=True)))
                if self._has_converged(populations[place], members):
                    converged[place] = True
                    ended = space.sorted(members).mean(axis=0)
                    populations[place] = starts.population(self.size, ended)
            if converged.all():
                return

    def _has_converged(self, population: "cmaes.CMA", members: np.ndarray) -> bool:
        return bool(np.ptp(members, axis=0).max() < self.accuracy or population.should_stop())


def _losses(gain: np.ndarray) -> np.ndarray:
    """Losses that a population minimises; where the gain is not finite, above all others."""
    worst = np.max(-gain, where=np.isfinite(gain), initial=0.0) + 1.0
    return np.where(np.isfinite(gain), -gain, worst)


class _Starts:
    """Starting points of populations: the best scattered placements far from all earlier ones.

    `even` are shares of placements that were scattered evenly [placement, side], `gain` their
    information gain [nat].
    """

    def __init__(self, even: np.ndarray, gain: np.ndarray, random: np.random.Generator):
        self._even, self._gain, self._random = even, gain, random
        self._distance = np.full(len(even), np.inf)
        spacing = len(even) ** (-1 / even.shape[1])
        self._width = min(WIDTH, spacing)

    def population(self, size: int, ended: np.ndarray | None = None) -> "cmaes.CMA":
        """Return a new population, far from where others began and the last one ended."""
        if ended is not None:
            self._exclude(ended)
        distant = self._distance > 2 * self._width
        score = np.where(distant, self._gain, -np.inf) if distant.any() else self._distance
        mean = self._even[np.argmax(score)]
        self._exclude(mean)
        seed = int(self._random.integers(2**31))
        import cmaes  # it takes long to import

        return cmaes.CMA(mean, self._width, seed=seed, population_size=size)

    def _exclude(self, shares: np.ndarray) -> None:
        self._distance = np.minimum(self._distance, np.abs(self._even - shares).max(axis=1))


def _generation(
    population: "cmaes.CMA", space: ContinuousSpace, even: np.ndarray, random: np.random.Generator
) -> np.ndarray:
    """Draw a generation that keeps to the rules, filled up from the scattered ones if necessary."""
    size = population.population_size
    members = np.zeros((0, even.shape[1]))
    for _ in range(TRIES):
        proposed = np.stack([population.ask() for _ in range(size)])
        members = np.concatenate([members, proposed[space.allowed(proposed)]])
        if len(members) >= size:
            return members[:size]
    return np.concatenate([members, random.choice(even, size - len(members))])


def _examples(experiment: Experiment, region: SearchRegion) -> Candidates:
    """Three places of a region."""
    shares = np.linspace(0.3, 0.7, 3)[:, None] * np.ones(len(region.sides))
    examples = region.candidates(experiment, shares)
    if np.unique(examples.forms()).size == len(shares):
        raise InfeasibleError(
            f'The tolerance of "{region.name}" is a distribution of another form at each place, '
            "which would be compiled by itself; one that differs only in values is needed. "
            "Declare at=positions.Box(...), or search a list of places by "
            "search=design.Exhaustive()."
        )
    return examples
