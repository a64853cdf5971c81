"""Evolutionary search (CMA-ES) for placements anywhere in regions."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import numpy as np
from numpyro.distributions import Uniform

from ..._shared.arguments import check_fields
from ..._shared.errors import InfeasibleError, InputError
from ..._shared.sites import is_unknown
from ...experiment.experiment import Experiment
from ...positions.bounds import in_space
from ...positions.places import Straight
from ...positions.tolerances import Segment, Tolerance
from .._candidates import Candidates, candidates, transducer
from ..running.evaluation import Evaluation
from . import Search, Trials, recorded, trials_of_selections
from ._search_space import Group, PlacementRules, SearchSpace, Selection, gain_in_one_shape

if TYPE_CHECKING:
    import cmaes


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


def search_region(experiment: Experiment, name: str, places: object) -> SearchRegion:
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


def _between(experiment: Experiment, name: str, places: object) -> Tolerance:
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
