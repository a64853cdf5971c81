"""What effects of few numbers at each place could remove of the misfit of modal parameters.

Each mode has one frequency, one damping ratio and one shape, so that no law over frequency can be
read. A mass, a spring, a dashpot or a cut is fitted at each place, all other unknowns with it.
"""

import dataclasses
from collections import Counter
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ...effects.library import kind_of, library
from ...experiment.experiment import Experiment
from ...inference.engines.least_squares import NormalEquations
from ...inference.engines.levenberg_marquardt import Objective, best_fit, minimise
from ...inference.residuals import Problem, fields_of, point_in_problem
from ._at_port import Point
from ._effect_as_law import EffectAsLaw
from ._free_law import Points
from ._named_laws import NamedLaw
from ._ports import NAME, Port, grid, place_columns

KINDS = (
    "point_mass",
    "ground_spring",
    "ground_dashpot",
    "rotary_inertia",
    "rotational_spring",
    "local_stiffness_loss",
)
"""Effects of the library of one number at a place, beside the extent of a loss."""

STRENGTHS = np.array([-1.5, -0.5, 0.5, 1.5])
"""Coordinates of a strength from which descents begin."""

BEST_PLACES = 3
"""Places from which the place is fitted too."""


class ReachOfEffect(NamedTuple):
    """What an effect can do, by place; fields as of `ReachOfPort`.

    The problem has it; points [place, unknown] are fits at each place. `squares` are NaN, since no
    law is free; `squares_of_law` are twice their costs, priors included.
    """

    port: Port
    problem: Problem
    points: Points
    squares: Float[np.ndarray, "place"]
    squares_of_law: Float[np.ndarray, "place"]
    log_evidence: Float[np.ndarray, "place"]


class Held:
    """An objective some of whose coordinates no descent changes."""

    def __init__(self, objective: Objective, columns: list[int]):
        self.cost, self._whole, self._columns = objective.cost, objective, columns

    def normal_equations(self, points: Points) -> NormalEquations:
        """Normal equations with no slope along what is held, and a curvature of one."""
        normal = self._whole.normal_equations(points)
        gradient, curvature = normal.gradient.copy(), normal.curvature.copy()
        gradient[:, self._columns] = 0.0
        curvature[:, self._columns] = 0.0
        curvature[:, :, self._columns] = 0.0
        curvature[:, self._columns, self._columns] = 1.0
        return normal._replace(gradient=gradient, curvature=curvature)


def ports_of_effects(experiment: Experiment) -> list[Port]:
    """Effects of the library that change modes, and where each acts."""
    effects = library(experiment, KINDS).effects
    return [Port(each.acts_on, dataclasses.replace(each, name=NAME)) for each in effects]


def reached_modes(
    problem: Problem, point: Point, ports: Sequence[Port], tick: Callable[[], None]
) -> tuple[list[ReachOfEffect], list[NamedLaw]]:
    """What effects at every kind of port can do, and the best of each.

    The point is the fit of the model; `tick` is called once for each effect.
    """
    alike = Counter(port.acts_on for port in ports)
    reached, named = [], []
    for port in ports:
        reached.append(_reach_of_effect(problem, point, port))
        named.append(_in_full(reached[-1], alike[port.acts_on]))
        tick()
    return reached, named


def _reach_of_effect(base: Problem, point: Point, port: Port) -> ReachOfEffect:
    problem = base.with_effect(port.effect)
    columns = place_columns(port, problem)
    places = grid(port, len(columns))
    starts = np.repeat(point_in_problem(base, point, problem)[None], len(places), axis=0)
    starts[:, columns] = places
    starts = np.repeat(starts, len(STRENGTHS), axis=0)
    starts[:, _strength(port, problem)] = np.tile(STRENGTHS, len(places))[:, None]
    ends, normal = minimise(Held(problem.squares.objective(), columns), starts, steps=15)
    evidence = np.nan_to_num(normal.log_evidence, nan=-np.inf).reshape(len(places), -1)
    best = np.arange(len(places)) * len(STRENGTHS) + np.argmax(evidence, axis=1)
    unknown = np.full(len(places), np.nan)
    return ReachOfEffect(
        port, problem, ends[best], unknown, 2 * normal.cost[best], evidence.max(axis=1)
    )


def _strength(port: Port, problem: Problem) -> list[int]:
    """Coordinates of its strength."""
    word = port.effect.absent[0]
    names = [name for name, field in fields_of(port.effect, problem).items() if field == word]
    places = [problem.coordinates.places[name] for name in names]
    return [column for place in places for column in range(place.start, place.stop)]


def _in_full(reach: ReachOfEffect, alike: int) -> NamedLaw:
    """The effect fitted with its place, from the best few of these."""
    problem, port = reach.problem, reach.port
    starts = reach.points[np.argsort(-reach.log_evidence)[:BEST_PLACES]]
    ends, normal = minimise(problem.squares.objective(), starts, steps=25)
    fit = best_fit(ends, normal, problem.count)
    values = problem.coordinates.named(fit.point[None])
    numbers = {
        unknown.field: (float(values[unknown.name].ravel()[0]), unknown.unit)
        for unknown in problem.experiment.unknowns_of(port.effect)
        if unknown.field not in port.effect.place_fields
    }
    kind = kind_of(port.effect)
    law = EffectAsLaw(kind, numbers)
    none = np.zeros(0)
    return NamedLaw(port, kind, law, None, fit.point, none, fit, -float(np.log(alike)))
