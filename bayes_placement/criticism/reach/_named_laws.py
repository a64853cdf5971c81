"""Every network at the best places of a kind of port; the best of them fitted in full."""

import json
import math
from collections import Counter
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ...inference.engines.least_squares import NormalEquations
from ...inference.engines.levenberg_marquardt import Fit, best_fit, minimise
from ...inference.residuals import Problem, at_known_noise
from ...laws.catalogue import leaves
from ...laws.law import Law, Tree
from ...laws.rows import NetworkRows
from ..kept_fits import NONE, fitted_in_processes
from ._asked import Rows
from ._at_port import (
    AnyPort,
    Places,
    Point,
    ReachOfPort,
    fitted_laws,
    kept,
    omega_of,
    reach_of_port,
    reach_of_scanned,
)
from ._effect_as_law import EffectAsLaw
from ._filters import ChannelFilter
from ._free_law import AnyLaw, Points
from ._free_law_of_many import FreeLawOfMany
from ._laws_at_places import Fitted
from ._laws_in_full import LawsInFull
from ._ports import Port
from ._scanned import Scanned, scanned

MOST_LINES = 400
"""Lines at which all networks are fitted: these are starts only."""

STARTS = 6
"""Draws of each network that are followed, at all places together."""

BEST_PLACES = 3
"""Places of a kind of port at which every network is fitted."""

STRONG = math.log(20.0)
"""Gain of log likelihood, or of log evidence, that counts: strong evidence."""

BEST_LAWS = 6
"""Laws of a kind of port that are fitted in full, with their places and all other unknowns."""

BEST_OF_MANY = 2
"""The same of laws that act at many places at once, whose responses take long: beside the best at
each place, since the extent leaves more than one hollow."""

REFINED, ROUNDS = 2, 3
"""Ports of the best laws, and how often every network is fitted there once more, at most."""

STEPS_OF_ANY_LAW = 12
"""Steps of descents with a law free at each line, which begin where all but the place is fitted."""


class NamedLaw(NamedTuple):
    """A network at a port, or a filter in channels, fitted in full.

    The tree is the network, or the filter; the law the same with its numbers, of modal parameters
    an effect. `rows` are all that were tried there; the point is in coordinates of the problem, the
    place among them, `numbers` are coordinates of those of the law. The log prior is that of the
    network, and of the piece, within its kind of port.
    """

    port: AnyPort
    tree: Tree
    law: Law | ChannelFilter | EffectAsLaw
    rows: Rows | None
    point: Float[np.ndarray, "unknown"]
    numbers: Float[np.ndarray, "number"]
    fit: Fit
    log_prior: float

    @property
    def log_odds(self) -> float:
        """Log evidence and log prior together."""
        return self.fit.log_evidence + self.log_prior

    @property
    def prior(self) -> Law:
        """The network with priors of its numbers."""
        assert isinstance(self.rows, NetworkRows)
        return self.rows.prior(self.rows.trees.index(self.tree))


def reached_ports(
    problem: Problem,
    point: Point,
    ports: Sequence[Port],
    tick: Callable[[], None],
    whole: Problem | None = None,
) -> tuple[list[ReachOfPort], list[NamedLaw]]:
    """What laws can do at kinds of ports of a structure, and the best of them.

    The point is the fit of the model; `tick` is called once for each kind of port. `whole` is the
    problem at all lines, where laws are fitted at some of them.
    """
    whole = None if whole is None else at_known_noise(whole, point)[0]
    problem, point = at_known_noise(problem, point)
    places = scanned(problem, point, ports, whole or problem)
    alike = Counter(port.acts_on for port in ports)
    pieces = [
        alike[port.acts_on] * (1 if at is None else at.scanned)
        for port, at in zip(ports, places, strict=True)
    ]
    # Those between two places take longest, and come first.
    order = sorted(range(len(ports)), key=lambda number: -len(ports[number].effect.place_fields))
    tasks = [(problem, point, ports[each], pieces[each], places[each]) for each in order]
    fits = fitted_in_processes(_reached_with_laws, tasks, lambda _: tick())
    found = [fit for _, fit in sorted(zip(order, fits, strict=True), key=lambda pair: pair[0])]
    reached, named = [reach for reach, _ in found], [laws for _, laws in found]
    order = sorted(range(len(ports)), key=lambda number: -_log_evidence(_best(named[number])))
    for number in order[:REFINED]:
        named[number] = _refined(reached[number], named[number], pieces[number])
    return reached, [law for laws in named for law in laws]


def squares_with_any_law(reached: Sequence[ReachOfPort]) -> float:
    """Least sum of squares with a law free at each line at one of some ports, its place fitted too.

    Nothing that is attached or inserted there leaves less.
    """
    return min(fitted_in_processes(_squares_with_any_law, [(reach,) for reach in reached]))


def _squares_with_any_law(reach: ReachOfPort) -> float:
    starts = reach.points[np.argsort(reach.squares)[:BEST_PLACES]]
    objective = AnyLaw(reach.free.released())

    def found() -> float:
        _, normal = minimise(objective, starts, steps=STEPS_OF_ANY_LAW)
        return float(np.min(normal.squares))

    return kept(found, 0.0, objective.free, reach.port, starts)


def _reached_with_laws(
    problem: Problem, point: Point, port: Port, pieces: int, at: Scanned | None
) -> tuple[ReachOfPort, list[NamedLaw]]:
    if at is None:
        reach = reach_of_port(problem, point, port)
    else:
        reach = reach_of_scanned(problem, point, port, at)
    return reach, laws_with_names(reach, pieces)


def _refined(reach: ReachOfPort, laws: list[NamedLaw], pieces: int) -> list[NamedLaw]:
    """The laws, and those at the place of the best of them, while these are better.

    On a grid those laws seem the best whose place matters least.
    """
    for _ in range(ROUNDS):
        before = _best(laws)
        laws = _best_of_each([*laws, *_laws_at(reach, before.point[None], pieces)])
        if _log_evidence(_best(laws)) < _log_evidence(before) + STRONG:
            break
    return laws


def _best(laws: Sequence[NamedLaw]) -> NamedLaw:
    return max(laws, key=_log_evidence)


def _log_evidence(law: NamedLaw) -> float:
    return law.fit.log_evidence


def _best_of_each(laws: Sequence[NamedLaw]) -> list[NamedLaw]:
    """Of each network the law of the greatest evidence."""
    best: dict[str, NamedLaw] = {}
    for law in sorted(laws, key=_log_evidence, reverse=True):
        best.setdefault(json.dumps(law.tree), law)
    return [*best.values()]


def simplest(laws: Sequence[NamedLaw]) -> list[NamedLaw]:
    """Laws without those that fit no better than a simpler one.

    The further elements are compatible with none, or the extent of a region is.
    """
    return [
        law
        for law in laws
        if not any(
            _is_simpler(other, law) and other.fit.squares < law.fit.squares + 2 * STRONG
            for other in laws
        )
    ]


def _is_simpler(one: NamedLaw, other: NamedLaw) -> bool:
    """Whether a law has fewer elements at the same port, or acts at one place, not on a region."""
    few, many = len(leaves(one.tree)), len(leaves(other.tree))
    if other.port.acts_on == "region" and one.port.acts_on == "displacement":
        return few <= many + 1  # the extent is one more number
    return one.port is other.port and few < many


def log_prior(tree: Tree, trees: Sequence[Tree]) -> float:
    """Log prior of a network: each further element halves it, networks of as many share it.

    Trees are all that are tried there, one of each class.
    """
    count = len(leaves(tree))
    alike = sum(len(leaves(other)) == count for other in trees)
    return -count * math.log(2.0) - math.log(alike)


def laws_with_names(reach: ReachOfPort, pieces: int) -> list[NamedLaw]:
    """Every network at the best few places; the best of them in full, with their places.

    `pieces` is the number of ports of this kind.
    """
    chosen = np.argsort(-reach.log_evidence)[:BEST_PLACES]
    return _laws_at(reach, reach.points[chosen], pieces)


def laws_at_place(
    problem: Problem, point: Point, port: Port, place: Places, pieces: int
) -> list[NamedLaw]:
    """Every network at one place of a port; the best of them in full, with it.

    The point is the fit of the model, the place [1, coordinate]; `pieces` is the number of ports of
    this kind.
    """
    reach = reach_of_port(*at_known_noise(problem, point), port, place)
    return _laws_at(reach, reach.points, pieces)


def _laws_at(reach: ReachOfPort, points: Points, pieces: int) -> list[NamedLaw]:
    """Every network at points, each of a place; the best of them in full."""
    rows, starts = reach.rows(), STARTS // len(points)
    every = np.arange(len(rows.trees))
    found = fitted_laws(reach.port, reach.free, rows, points, every, starts, MOST_LINES)
    if isinstance(reach.free, FreeLawOfMany):
        laws, _, evidence = found
        of_places = [laws[place, row] for place, row in enumerate(np.argmax(evidence, axis=1))]
        begins = [*of_places, *_best_rows(found, rows.trees)[:BEST_OF_MANY]]
    else:
        begins = _best_rows(found, rows.trees)[:BEST_LAWS]
    return _in_full(reach, rows, np.array(begins), pieces)


def _best_rows(found: Fitted, trees: Sequence[Tree]) -> list[np.ndarray]:
    """Best fit of each network, the best first, but of those that do no more than a part of them.

    All that contain one of the best would leave no room for others.
    """
    laws, cost, evidence = found
    rows = laws.reshape(-1, laws.shape[-1])
    best: dict[int, int] = {}  # of each network
    for number in np.argsort(-evidence.ravel()):
        best.setdefault(int(rows[number, -1]), number)
    squares = {network: 2 * cost.ravel()[number] for network, number in best.items()}
    return [
        rows[number]
        for network, number in best.items()
        if not any(
            _is_part(trees[part], trees[network]) and squares[part] < squares[network] + 2 * STRONG
            for part in squares
        )
    ]


def _is_part(tree: Tree, whole: Tree) -> bool:
    """Whether a network has some of the elements of another one, but not all."""
    return Counter(leaves(tree)) < Counter(leaves(whole))


def _in_full(reach: ReachOfPort, rows: Rows, starts: Points, pieces: int) -> list[NamedLaw]:
    free = reach.free.released()
    objective = LawsInFull(free, rows, omega_of(free), reach.port.is_cut)
    ends, normal = kept(
        lambda: minimise(objective, starts, steps=25, largest=objective.largest),
        (NONE, NormalEquations(NONE, NONE, NONE, NONE)),
        free,
        reach.port,
        starts,
    )
    named = []
    for row in range(len(ends)):
        here = type(normal)(*(values[row : row + 1] for values in normal))
        inner = here._replace(gradient=here.gradient[:, :-1], curvature=here.curvature[:, :-1, :-1])
        fit = best_fit(ends[row : row + 1, :-1], inner, free.problem.count)
        network, size = int(ends[row, -1]), free.problem.dimension
        numbers = ends[row, size:-1]
        law = rows.law(network, numbers)
        tree = rows.trees[network]
        prior = float(log_prior(tree, rows.trees) - np.log(pieces))
        named.append(NamedLaw(reach.port, tree, law, rows, ends[row, :size], numbers, fit, prior))
    return named
