"""Measurements of random structures that hide an effect, by seed and name of the effect.

Independent of bayes_placement.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.optimize

from tests.simulator.fine_elements import ELEMENTS, Effect, Line
from tests.simulator.hidden_scenes import COARSE, EFFECTS, Scene, drawn
from tests.simulator.hidden_structures import Instrument, Record, accelerance, deviation, record

MISFIT = (3.0, 30.0)

Key = tuple[int, ...]

Drawer = Callable[[Key, str | None, float], Scene]
"""Draws the scene of a key that hides an effect of a name and a strength."""


@dataclass(frozen=True)
class Draw:
    """What is given to the engineer (nominal, priors, instruments, records), and the truth."""

    nominal: Line
    priors: dict[str, tuple[float, float]]  # uniform, by field of the nominal structure
    sensors: tuple[Instrument, ...]
    actuators: tuple[Instrument, ...]
    records: tuple[Record, ...]  # one for each force level
    true: Line
    hidden: Effect
    misfit: float  # chi2 per datum without the effect, all else true


def draw(seed: int, name: str | None = None, after_fit: bool = False) -> Draw:
    """Draw a structure that hides the effect of this name, `any` effect, or nothing.

    The strength is such that the structure without the effect has a chi2 per datum between 3 and
    30 (log-uniform), all else true; or, `after_fit`, with all else fitted within its priors, which
    is what an engineer sees. Dimensions for which no strength will do are drawn anew.
    """
    if name == "any":
        name = str(np.random.default_rng([seed, 7]).choice(sorted(EFFECTS)))
    for attempt in range(50):
        key = (seed, attempt)
        scene = tuned(key, name, after_fit) if name else drawn(key, None, 0.0)
        if scene is not None:
            return measured(scene, np.random.default_rng([*key, 1]))
    raise ValueError(f"No strength of {name} gives a misfit between 3 and 30 for seed {seed}.")


def measured(scene: Scene, generator: np.random.Generator) -> Draw:
    averages = int(generator.choice([16, 32]))
    responses = zip(scene.responses(scene.hidden, ELEMENTS), scene.force_levels, strict=True)
    records = [
        record(exact, scene.frequency, generator, averages, level) for exact, level in responses
    ]
    return Draw(
        nominal=scene.nominal,
        priors=scene.priors,
        sensors=scene.sensors,
        actuators=scene.actuators,
        records=tuple(records),
        true=scene.true,
        hidden=scene.hidden,
        misfit=scene.misfit(),
    )


def tuned(key: Key, name: str, after_fit: bool = False) -> Scene | None:
    """Find a strength; None where none will do."""
    target = float(np.exp(np.random.default_rng([*key, 2]).uniform(*np.log(MISFIT))))
    strength = bisected(key, name, target)
    if strength and after_fit:
        strength = strengthened(key, name, target, strength)
    if not strength:
        return None
    scene = drawn(key, name, strength)
    return scene if one_motion(scene) else None


def bisected(key: Key, name: str, target: float, scene_of: Drawer = drawn) -> float | None:
    """Strength whose misfit, all else true, is the target: bisection of the logarithm."""

    def excess(log_strength: float) -> float:
        return np.log(scene_of(key, name, np.exp(log_strength)).misfit() / target)

    low, high = np.log(EFFECTS[name].strengths)
    if not excess(low) < 0 < excess(high):
        return None
    return float(np.exp(scipy.optimize.bisect(excess, low, high, xtol=0.005)))


def strengthened(key: Key, name: str, target: float, strength: float) -> float | None:
    """Strength whose misfit after a fit is near the target: secants of the logarithms."""
    low, high = EFFECTS[name].strengths
    power, earlier = 2.0, None  # most misfits grow with the square of the strength
    for _ in range(8):
        excess = max(fitted_misfit(drawn(key, name, strength)) - 1, 1e-3)
        if MISFIT[0] < 1 + excess < MISFIT[1] and 0.7 < excess / (target - 1) < 1.4:
            return strength
        if earlier and strength != earlier[0]:
            slope = np.log(excess / earlier[1]) / np.log(strength / earlier[0])
            power = np.clip(slope, 1.0, 6.0)
        earlier = strength, excess
        factor = np.clip(((target - 1) / excess) ** (1 / power), 0.1, 10.0)
        strength = float(np.clip(strength * factor, low, high))
    return None


def fitted_misfit(scene: Scene) -> float:
    """Expected chi2 per datum of the best fit without the effect, within priors and tolerances."""
    exact = scene.responses(scene.hidden, COARSE)
    error = deviation(exact)
    low, high, truth, predicted = free(scene)

    def residual(share: np.ndarray) -> np.ndarray:
        missed = ((predicted(low + share * (high - low)) - exact) / error).ravel()
        return np.concatenate([missed.real, missed.imag])

    start = np.clip((truth - low) / (high - low), 0.01, 0.99)
    best = scipy.optimize.least_squares(
        residual, start, bounds=(0, 1), diff_step=1e-5, xtol=1e-4, ftol=1e-4, max_nfev=25
    )
    return 1 + 2 * float(best.cost) / exact.size


def free(
    scene: Scene,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, Callable[[np.ndarray], np.ndarray]]:
    """Bounds and truth of what is unknown, and the response that follows from it."""
    instruments = (*scene.sensors, *scene.actuators)
    bounds = [*scene.priors.values()]
    bounds += [
        (instrument.recorded - instrument.within, instrument.recorded + instrument.within)
        for instrument in instruments
    ]
    truth = [getattr(scene.true, name) for name in scene.priors]
    truth += [instrument.true for instrument in instruments]

    def predicted(values: np.ndarray) -> np.ndarray:
        line = replace(scene.true, **dict(zip(scene.priors, values.tolist(), strict=False)))
        places = values[len(scene.priors) :].tolist()
        moved = [
            replace(instrument, true=place)
            for instrument, place in zip(instruments, places, strict=True)
        ]
        count = len(scene.sensors)
        sides = moved[:count], moved[count:]
        return accelerance(line, *sides, scene.frequency, elements=COARSE)

    low, high = np.array(bounds).T
    return low, high, np.array(truth), predicted


def one_motion(scene: Scene) -> bool:
    """Whether sweeps upwards and downwards agree, as those of a linear structure do."""
    if scene.hidden.name != "cubic_stiffness":
        return True
    back = replace(scene, frequency=scene.frequency[::-1])
    up, down = (run.responses(scene.hidden, COARSE) for run in (scene, back))
    return np.allclose(up, down[..., ::-1], rtol=1e-6)
