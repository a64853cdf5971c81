"""Hypotheses whose springs to the ground have a loss, as real mounts do."""

import functools
from collections.abc import Callable, Sequence

import numpy as np
from numpyro.distributions import LogUniform, Uniform

from ...effects.attached import Attached
from ...effects.effect import Effect
from ...effects.fractional_mount import FractionalMount
from ...effects.ground_spring import GroundSpring
from ...effects.scales import Scales
from ...inference.residuals import Problem
from ...laws import LossySpring
from ._descents import fit_grown
from ._hypotheses import Hypothesis


def on_mounts(hypotheses: Sequence[Hypothesis], null: Hypothesis) -> list[Hypothesis]:
    """Those with springs to the ground, fitted once more with lossy springs and with rubber."""
    rubber = functools.partial(_rubber, frequency=Scales(null.problem.experiment).middle)
    mounted = []
    for hypothesis in hypotheses:
        for mount in (_lossy_spring, rubber):
            effects = tuple(_mounted(effect, mount) for effect in hypothesis.effects)
            if effects != hypothesis.effects:
                problem = functools.reduce(Problem.with_effect, effects, null.problem)
                start = _start(hypothesis, problem)[None]
                mounted.append(Hypothesis(effects, problem, *fit_grown(problem, start, start)))
    return mounted


def _mounted(effect: Effect, mount: Callable[[GroundSpring], Effect]) -> Effect:
    return mount(effect) if isinstance(effect, GroundSpring) else effect


def _lossy_spring(spring: GroundSpring) -> Attached:
    law = LossySpring(spring.stiffness, LogUniform(1e-3, 1.0))
    return Attached(spring.at, law, direction=spring.direction, name=spring.name)


def _rubber(spring: GroundSpring, frequency: float) -> FractionalMount:
    values = spring.at, spring.stiffness, Uniform(0.0, 1.0), frequency
    return FractionalMount(*values, direction=spring.direction, name=spring.name)


def _start(before: Hypothesis, problem: Problem) -> np.ndarray:
    """The fit of the springs as coordinates of the mounts, losses at their medians."""
    start, places = before.point_in(problem), problem.coordinates.places
    for name, place in before.problem.coordinates.places.items():
        of_law = name.replace(".stiffness", ".law.stiffness")
        if of_law in places:
            start[places[of_law]] = before.fit.point[place]
    return start
