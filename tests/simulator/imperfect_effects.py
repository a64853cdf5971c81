"""Effects of any strength on bars, beams and plates. Independent of bayes_placement."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.simulator import hidden_scenes
from tests.simulator.fine_elements import Effect, Line, effect
from tests.simulator.hidden_scenes import in_band, log_uniform, whose
from tests.simulator.imperfect_scenes import FORMS, PIECES, Scene, place_of, somewhere


@dataclass(frozen=True)
class Kind:
    """How an effect is made, between which strengths, and of which forms it is known."""

    make: Callable[[np.random.Generator, Scene, float], Effect]
    strengths: tuple[float, float]
    forms: tuple[str, ...] = FORMS


def made(key: tuple[int, ...], scene: Scene, name: str, strength: float) -> Effect:
    """The effect of a key, the same for every strength but for what the strength says."""
    return EFFECTS[name].make(np.random.default_rng([*key, 4]), scene, strength)


def attached_at(generator: np.random.Generator, scene: Scene):
    return somewhere(generator, scene.true, 0.1)


def point_mass(generator, scene, strength):
    at = attached_at(generator, scene)
    return effect("point_mass", at=at, mass=strength * scene.nominal.mass)


def ground_spring(generator, scene, strength):
    stiffness = strength * scene.nominal.mass * scene.first**2
    return effect("ground_spring", at=attached_at(generator, scene), stiffness=stiffness)


def ground_dashpot(generator, scene, strength):
    viscosity = strength * scene.nominal.mass * scene.first
    return effect("ground_dashpot", at=attached_at(generator, scene), viscosity=viscosity)


def tuned_absorber(generator, scene, strength):
    return effect(
        "tuned_absorber",
        at=attached_at(generator, scene),
        frequency=in_band(generator, scene),
        damping_ratio=log_uniform(generator, 0.01, 0.1),
        mass=strength * scene.nominal.mass,
    )


def local_stiffness_loss(generator, scene, strength):
    if isinstance(scene.true, Line):
        return hidden_scenes.local_stiffness_loss(generator, scene, strength)
    region = int(generator.integers(PIECES))
    return effect("local_stiffness_loss", region=region, loss=strength)


def gain_error(generator, scene, strength):
    error = strength * float(generator.choice([-1.0, 1.0]))
    return effect("gain_error", sensor=whose(generator, scene).name, error=error)


def misplaced_sensor(generator, scene, strength):
    """A sensor moved by a share of the length, towards a place at least as far away."""
    sensor, length = whose(generator, scene), scene.true.length
    start = np.atleast_1d(sensor.recorded)
    away = np.zeros_like(start)
    while np.linalg.norm(away) < FARTHEST * length:
        away = np.atleast_1d(somewhere(generator, scene.true, 0.05)) - start
    position = start + strength * length * away / np.linalg.norm(away)
    return effect("misplaced_sensor", sensor=sensor.name, position=place_of(position))


def reversed_sensor(generator, scene, strength):
    return effect("reversed_sensor", sensor=whose(generator, scene).name)


FARTHEST = 0.35
"""Of the length: some place on a structure is as far from any other."""

EFFECTS = {
    "point_mass": Kind(point_mass, (1e-4, 0.5)),
    "ground_spring": Kind(ground_spring, (1e-3, 1e3)),
    "ground_dashpot": Kind(ground_dashpot, (1e-4, 1e1)),
    "tuned_absorber": Kind(tuned_absorber, (1e-4, 0.3)),
    "local_stiffness_loss": Kind(local_stiffness_loss, (3e-3, 0.95)),
    "compliant_support": Kind(hidden_scenes.compliant_support, (1e-4, 1.0), ("bar",)),
    "gain_error": Kind(gain_error, (3e-3, 0.9)),
    "misplaced_sensor": Kind(misplaced_sensor, (0.05, FARTHEST)),
    "reversed_sensor": Kind(reversed_sensor, (1.0, 1.0)),
}
