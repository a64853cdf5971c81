"""Hypotheses with one more effect that is in no list: a network at a port, place before law."""

import functools
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...effects.attached import GivenLaw
from ...effects.effect import Effect, OnPorts
from ...effects.library import kind_of
from ...effects.registry import attached
from ...effects.strut import Strut
from ...experiment.experiment import Experiment
from ...inference.chi2 import LEVEL
from ...inference.engines.empirical_bayes import DECREASING_ERRORS
from ...inference.engines.levenberg_marquardt import best_fit, minimise
from ...inference.residuals import Problem, at_known_noise, fields_of
from ...laws import Spring
from ...laws.law import Tree
from ...laws.rows import coordinates_of_numbers
from ..kept_fits import kept_with_sizes
from ..reach._at_port import ReachOfPort
from ..reach._free_law import tells_phase
from ..reach._named_laws import (
    NamedLaw,
    laws_at_place,
    log_prior,
    reached_ports,
    simplest,
    squares_with_any_law,
)
from ..reach._ports import (
    NAME,
    Port,
    can_be_reached,
    every_port,
    place_columns,
    ports_of,
    ports_of_many,
    trees_at,
)
from ..reach.reach import Reach, reach_of
from ._candidates import numbered
from ._fitted_candidates import extended, without
from ._hypotheses import Hypothesis, finite, takes_long
from ._posterior_odds import STRONG, Comparison, explains, passes
from ._rows import row_of
from ._scanned_candidates import Pair, Tick
from .table import Policy

FITTED = 4
"""Networks, at most, that are fitted as effects of the experiment."""

Found = tuple[list[ReachOfPort], list[NamedLaw]]
"""What laws can do at ports, and the best of them."""

Network = tuple[str, Tree]
"""What a network acts on, and the network."""

LISTED: Mapping[str, Network] = {
    "point_mass": ("displacement", "m"),
    "ground_spring": ("displacement", "k"),
    "ground_dashpot": ("displacement", "c"),
    "tuned_absorber": ("displacement", ["-", "m", ["|", "c", "k"]]),
    "rotary_inertia": ("rotation", "m"),
    "rotational_spring": ("rotation", "k"),
    "segment_mass": ("region", "m"),
    "foundation": ("region", "k"),
    "viscoelastic_modulus": ("structure", ["-", "c", "k"]),
}
"""Effects of the library that are networks."""

WITHIN = 2 * STRONG
"""Log odds behind the best network from which on others are left out."""


class LawsBeside:
    """Laws that are in no list at the ports of a hypothesis, looked for when first asked for.

    None where it passes its check, or where there is no complex FRF at which a law is read.

    `tick` is called once for each kind of port. `before` is the same hypothesis as an earlier state
    tells it, with its sizes of a model error: of the fit to both states these take up what is new.
    """

    def __init__(self, base: Hypothesis, tick: Tick, before: Hypothesis | None = None):
        self.base, self._known, self._tick = base, before or base, tick

    def at_ports(self) -> list[NamedLaw]:
        """Look for them; those of about the greatest odds."""
        return _probable(self._at_ports[1])

    def of_many(self) -> list[NamedLaw]:
        """The same with laws that act at many places at once, which take longer."""
        return _probable([*self._at_ports[1], *self._of_many[1]])

    def look(self) -> None:
        """Look for those at one port, and what they reach."""
        self._reach_at_ports  # noqa: B018  it is kept

    def may_explain(self, level: float) -> bool:
        """Whether a law that is free at each line could leave nothing but noise at one port.

        The level is the probability that a correct model fails its check. No check tells it of
        unknown noise, nor where no law is read.
        """
        reached, _ = self._at_ports
        if not (self.base.is_noise_known and reached):
            return True
        row = row_of(self.base)._replace(squares=squares_with_any_law(reached))
        return row.explains(Policy(level=level))

    def is_bounded(self, effect: Effect) -> bool:
        """Whether an effect is a law at one of the ports, where the free one does more."""
        kinds = {reach.port.acts_on for reach in self._at_ports[0]}
        modes = self.base.problem.experiment.structure.modes
        is_law = isinstance(effect, OnPorts) and effect.uncertain_ports(modes) < 2
        return is_law and effect.acts_on in kinds

    def is_bounded_or_long(self, effect: Effect) -> bool:
        """Whether it is such a law, or takes long to evaluate."""
        return effect.takes_long or self.is_bounded(effect)

    def reach(self) -> Reach | None:
        """What laws reach that were looked for; None beside effects."""
        if "_of_many" not in vars(self):  # until they are looked for
            return self._reach_at_ports
        reached, laws = self._at_ports
        return self._reach([*reached, *self._of_many[0]], [*laws, *self._of_many[1]])

    @functools.cached_property
    def _reach_at_ports(self) -> Reach | None:
        return self._reach(*self._at_ports)

    def _reach(self, reached: list[ReachOfPort], laws: list[NamedLaw]) -> Reach | None:
        if self.base.effects or not reached:
            return None
        return reach_of(self._known.problem, self.base.fit, reached, laws)

    @functools.cached_property
    def _at_ports(self) -> Found:
        return self._look(ports_of)

    @functools.cached_property
    def _of_many(self) -> Found:
        return self._look(ports_of_many)

    def _look(self, ports: Callable[[Experiment], list[Port]]) -> Found:
        problem = self._known.problem
        reads_laws = tells_phase(self.base.problem) and can_be_reached(self.base.problem)
        if passes(self.base, LEVEL) or not reads_laws:
            return [], []
        at = ports(problem.experiment)
        return reached_ports(problem, self._known.fit.point, at, self._tick)


def with_networks(comparison: Comparison, laws: LawsBeside) -> Comparison:
    """Add the networks of the greatest odds at ports of a hypothesis, each fitted.

    With a model error, where laws take minutes, none where another hypothesis explains the data. Of
    two states networks act in the later one.
    """
    if laws.base.has_errors and explains(comparison.best(), LEVEL):
        return comparison
    return _and_reach(_with_laws(comparison, laws.base, laws.at_ports()), laws)


def with_networks_of_many(comparison: Comparison, laws: LawsBeside) -> Comparison:
    """Add networks that act at many places at once, where nothing else explains the data."""
    if explains(comparison.best(), LEVEL):
        return comparison
    return _and_reach(_with_laws(comparison, laws.base, laws.of_many()), laws)


def _and_reach(comparison: Comparison, laws: LawsBeside) -> Comparison:
    reach = laws.reach()
    return comparison if reach is None else comparison._replace(reach=reach)


def laws_beside_best(comparison: Comparison, depth: int, tick: Tick) -> LawsBeside | None:
    """Laws beside the best hypothesis of so many effects, none of which takes long."""
    ranked = [h for h in comparison.distinct() if len(h.effects) == depth and not takes_long(h)]
    return LawsBeside(ranked[0], tick) if ranked else None


def _probable(found: Sequence[NamedLaw]) -> list[NamedLaw]:
    """Laws of about the greatest odds, the greatest first."""
    laws = sorted(simplest(found), key=lambda law: -law.log_odds)
    return [law for law in laws if law.log_odds > laws[0].log_odds - WITHIN]


def _with_laws(comparison: Comparison, base: Hypothesis, laws: Sequence[NamedLaw]) -> Comparison:
    """Add laws that are in no list to a hypothesis, each fitted as an effect."""
    listed = _listed(comparison)
    chosen = [law for law in laws if _network(law) not in listed][:FITTED]
    hypotheses = [_as_hypothesis(base, law) for law in chosen]
    kinds = [kind_of(hypothesis.effects[-1]) for hypothesis in hypotheses]
    priors = {kind: law.log_prior for kind, law in zip(kinds, chosen, strict=True)}
    return comparison.with_hypotheses(finite(hypotheses), priors)


def _listed(comparison: Comparison) -> list[Network]:
    """Networks that are effects of the library, of those that were tried."""
    tried = {kind_of(candidate.effect) for candidate in comparison.candidates}
    return [network for kind, network in LISTED.items() if kind in tried]


def _network(law: NamedLaw) -> Network:
    return law.port.acts_on, law.tree


def with_other_laws(
    comparison: Comparison, tick: Tick, looked: LawsBeside | None = None
) -> Comparison:
    """Try all networks in the place of each one of the best hypothesis of several effects.

    Alone, a network took up a little of what the others do: beside them it may be another one, and
    on another kind of port. With a model error, or beside what takes long, it stays where it is.
    Effects of the library that are networks may be others at the same place.

    `tick` is called once for each network that is replaced, and once for each kind of port. Laws
    that were looked for beside a hypothesis are not looked for again.
    """
    best, null = comparison.best(), comparison.of(())
    if len(best.effects) < 2 or not can_be_reached(null.problem):
        return comparison
    for effect in best.effects:
        is_network = kind_of(effect) in comparison.networks
        at_place = _with_any_law(effect) if is_network or not best.has_errors else None
        if at_place is None:
            continue
        rest = without(best, effect.name, null)
        found = _laws_at_place_of(at_place, effect, best, rest)
        is_known = looked is not None and looked.base.kinds == rest.kinds
        is_slow = best.has_errors or takes_long(rest)
        if is_network and not (is_slow or is_known) and tells_phase(null.problem):
            ports = ports_of(rest.problem.experiment)
            found += reached_ports(rest.problem, rest.fit.point, ports, tick)[1]
        laws = _probable(found)
        comparison = _with_laws(comparison, rest, laws)
        pairs: list[Pair] = [(rest, each) for each in _listed_effects(comparison, laws)]
        comparison = comparison.with_hypotheses(extended([[pair] for pair in pairs], tick))
        tick()
    return comparison


def _with_any_law(effect: Any) -> Port | None:
    """The port of an effect that is a network there; None of others, and of lists on regions."""
    if isinstance(effect, GivenLaw | Strut):
        return Port(effect.acts_on, replace(effect, law=Spring(1.0), name=NAME))
    if kind_of(effect) not in LISTED or effect.acts_on not in ("displacement", "rotation"):
        return None
    given = {"direction": effect.direction, "motion": effect.acts_on, "name": NAME}
    return Port(effect.acts_on, attached(effect.at, Spring(1.0), **given))


def _laws_at_place_of(
    port: Port, effect: Effect, best: Hypothesis, rest: Hypothesis
) -> list[NamedLaw]:
    """Every network at the place of an effect, beside the others."""
    columns = place_columns(Port(effect.acts_on, effect), best.problem)
    pieces = sum(each.acts_on == port.acts_on for each in every_port(rest.problem.experiment))
    place = best.fit.point[None, columns]
    return laws_at_place(rest.problem, rest.fit.point, port, place, pieces)


def _listed_effects(comparison: Comparison, laws: Sequence[NamedLaw]) -> list[Effect]:
    """Candidates of the library that are these networks."""
    found = [_network(law) for law in laws]
    kinds = {kind for kind, network in LISTED.items() if network in found}
    return [each.effect for each in comparison.candidates if kind_of(each.effect) in kinds]


def priors_of_networks(hypothesis: Hypothesis, comparison: Comparison) -> dict[str, float]:
    """Log priors of networks that were found by another search."""
    pieces = Counter(port.acts_on for port in every_port(hypothesis.problem.experiment))
    networks = [
        effect
        for effect in hypothesis.effects
        if isinstance(effect, GivenLaw | Strut) and kind_of(effect) not in comparison.variants
    ]
    return {
        kind_of(each): log_prior(each.law.tree(), trees_at(each.acts_on))
        - math.log(pieces[each.acts_on])
        for each in networks
    }


def _as_hypothesis(base: Hypothesis, law: NamedLaw) -> Hypothesis:
    """The network as an effect of the experiment, fitted from where it was found."""
    names = {effect.name for effect in base.problem.experiment.effects}
    assert isinstance(law.port, Port)
    effect = numbered(law.port.with_law(law.prior, law.port.name()), names)
    problem = base.problem.with_effect(effect)
    start = _start(base, law, effect, problem)
    effects = (*base.effects, effect)
    if base.has_errors:
        sized = kept_with_sizes(problem, start[None], DECREASING_ERRORS[-1:])
        return Hypothesis(effects, has_errors=True, **vars(sized))
    ends, normal = minimise(problem.squares.objective(), start[None], steps=20, count=problem.count)
    return Hypothesis(effects, problem, best_fit(ends, normal, problem.count), near=start[None])


def _start(base: Hypothesis, law: NamedLaw, effect: Effect, problem: Problem) -> np.ndarray:
    """Where it was found, in the coordinates of the problem."""
    found = at_known_noise(base.problem, base.fit.point)[0].with_effect(law.port.effect)
    start = base.point_in(problem)
    for name, place in found.coordinates.places.items():
        target = name.replace(NAME, effect.name)
        if target in problem.coordinates.places:
            start[problem.coordinates.places[target]] = law.point[place]
    before, after = (Port(law.port.acts_on, each) for each in (law.port.effect, effect))
    start[place_columns(after, problem)] = law.point[place_columns(before, found)]
    numbers = [name for name, word in fields_of(effect, problem).items() if word == "law"]
    for name, column in zip(numbers, coordinates_of_numbers(law.tree), strict=True):
        start[problem.coordinates.places[name]] = law.numbers[column]
    return start
