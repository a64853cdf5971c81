"""Structures that hide nothing, one effect or two, each from invisible to plain.

Those with many data show an effect plainly by far less than the noise of a line; those with few
data leave more doubt. Independent of bayes_placement.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.optimize

from tests.simulator.fine_elements import NOTHING
from tests.simulator.hidden_draws import Draw, Drawer, Key, bisected, measured, one_motion
from tests.simulator.hidden_scenes import COARSE, EFFECTS, Scene, drawn
from tests.simulator.hidden_structures import deviation

SHARES = (0.3, 0.5, 0.2)
"""Shares of structures that hide nothing, one effect and two."""

EXCESS = (0.003, 30.0)
"""Chi2 per datum, less 1, of a structure without the effect, all else true; log-uniform."""

FEW_LINES, FEW_SENSORS, FEW_ACTUATORS = 75, 3, 1
"""What structures with few data are measured with."""

FEW_DATA = 2 * FEW_LINES * FEW_SENSORS * FEW_ACTUATORS
"""Real and imaginary parts of these."""

FAINT = (10.0, 3000.0)
"""Chi2, less the number of data, of a structure with few data without the effect; log-uniform."""

MASS = "point_mass"
"""The second of two effects, which a structure can have besides any other."""

NO_SECOND = (MASS, "sensor_mass", "cubic_stiffness")

MASSES = (1e-6, 1.0)
"""Least and greatest mass over that of the structure."""


@dataclass(frozen=True)
class Graded:
    """A draw, the names of all that it hides, and the excess of chi2 per datum of each."""

    draw: Draw
    hidden: tuple[str, ...]
    excess: tuple[float, ...]


def graded(seed: int) -> Graded:
    """Draw a structure; dimensions for which no strength will do are drawn anew."""
    return _first_possible(seed, drawn, EXCESS, ())


def faint(seed: int) -> Graded:
    """Draw a structure with few data; it has no force levels, and so no nonlinear effect."""
    excess = (FAINT[0] / FEW_DATA, FAINT[1] / FEW_DATA)
    return _first_possible(seed, _with_few_data, excess, ("cubic_stiffness",))


def _with_few_data(key: Key, name: str | None, strength: float) -> Scene:
    scene = drawn(key, name, strength)
    lines = np.linspace(0, scene.frequency.size - 1, FEW_LINES).round().astype(int)
    return replace(
        scene,
        sensors=scene.sensors[:FEW_SENSORS],
        actuators=scene.actuators[:FEW_ACTUATORS],
        frequency=scene.frequency[lines],
        force_levels=(None,),
    )


def _first_possible(
    seed: int, scene_of: Drawer, bounds: tuple[float, float], never: tuple[str, ...]
) -> Graded:
    count = int(np.random.default_rng([seed, 9]).choice(len(SHARES), p=SHARES))
    for attempt in range(50):
        key = (seed, attempt)
        scene, excess = _drawn(key, count, scene_of, bounds, never)
        if scene is not None:
            names = (scene.hidden.name, MASS)[:count]
            return Graded(measured(scene, np.random.default_rng([*key, 1])), names, excess)
    raise ValueError(f"Nothing was drawn for seed {seed}.")


def _drawn(
    key: Key, count: int, scene_of: Drawer, bounds: tuple[float, float], never: tuple[str, ...]
) -> tuple[Scene | None, tuple[float, ...]]:
    """A scene that hides so many effects, None where no strength will do; the excess of each."""
    generator = np.random.default_rng([*key, 2])
    excess = tuple(np.exp(generator.uniform(*np.log(bounds), count)).tolist())
    if not excess:
        return scene_of(key, None, 0.0), excess
    possible = sorted(set(EFFECTS) - set(NO_SECOND if count == 2 else ()) - set(never))
    name = str(generator.choice(possible))
    strength = bisected(key, name, 1 + excess[0], scene_of)
    scene = scene_of(key, name, strength) if strength else None
    if scene is None or not one_motion(scene):
        return None, excess
    return (scene if count == 1 else _with_mass(scene, generator, excess[1])), excess


def _with_mass(scene: Scene, generator: np.random.Generator, excess: float) -> Scene | None:
    """The scene with a forgotten mass, which shows by an excess of chi2 per datum."""
    place = generator.uniform(0.1, 0.9) * scene.true.length

    def heavier(log_share: float) -> Scene:
        mass = np.exp(log_share) * scene.true.mass
        return replace(scene, true=replace(scene.true, attached=((place, mass),)))

    without = scene.responses(NOTHING, COARSE)

    def missed(log_share: float) -> float:
        exact = heavier(log_share).responses(NOTHING, COARSE)
        return float(np.log(np.mean(np.abs(exact - without) ** 2 / deviation(exact) ** 2) / excess))

    low, high = np.log(MASSES)
    if not missed(low) < 0 < missed(high):
        return None
    return heavier(float(scipy.optimize.bisect(missed, low, high, xtol=0.005)))
