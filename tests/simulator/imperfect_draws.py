"""Measurements of imperfect structures before and after an effect, by seed.

Independent of bayes_placement.
"""

from dataclasses import dataclass, replace

import numpy as np

from tests.simulator.fine_elements import NOTHING, Effect
from tests.simulator.hidden_scenes import COARSE
from tests.simulator.hidden_structures import Instrument, Record, record
from tests.simulator.imperfect_effects import EFFECTS, made
from tests.simulator.imperfect_scenes import FLAWS, FORMS, Scene, Sizes, Structure, drawn
from tests.simulator.nominal_fits import NominalFit

AVERAGES = 32
TRIALS = 16  # bisections of the logarithm of a strength
CONSPICUOUS = ("misplaced_sensor", "reversed_sensor")
"""Effects that show more than was asked where they are as weak as they can be."""

Key = tuple[int, ...]


@dataclass(frozen=True)
class ImperfectDraw:
    """What is given to the engineer (nominal, priors, instruments, records), and the truth."""

    form: str
    nominal: Structure
    priors: dict[str, tuple[float, float]]  # uniform, by field of the nominal structure
    sensors: tuple[Instrument, ...]
    actuators: tuple[Instrument, ...]
    records: tuple[Record, ...]  # one, with the effect
    baseline: Record
    true: Structure  # with its flaws
    gains: np.ndarray
    hidden: Effect
    chi2: tuple[float, float]  # expected, of the best nominal fit to baseline and to measured

    @property
    def ratio(self) -> float:
        """Best nominal chi2 of what was measured over that of the baseline."""
        return self.chi2[1] / self.chi2[0]


def draw(
    seed: int,
    name: str | None = None,
    ratio: float = 4.0,
    form: str | None = None,
    sizes: Sizes = FLAWS,
) -> ImperfectDraw:
    """Draw an imperfect structure that hides the effect of this name, `any` effect, or nothing.

    The strength is such that the best nominal chi2 is at least `ratio` times that of the baseline,
    and exceeds 1 by at most a tenth more, a misplaced or reversed sensor apart. Structures on which
    no strength will do are drawn anew. Forms take turns with the seed where none is asked for.
    """
    form = form or FORMS[seed % len(FORMS)]
    for attempt in range(50):
        key = (seed, attempt)
        scene, kind = drawn(key, form, sizes), name
        if name == "any":
            kind = str(np.random.default_rng([*key, 7]).choice(possible(form, ratio)))
        fits = tuned(key, scene, kind, ratio) if kind else without(scene)
        if fits is not None:
            return measured(*fits, np.random.default_rng([*key, 1]))
    raise ValueError(f"No strength of {name} gives a ratio of {ratio:g} for seed {seed}.")


def possible(form: str, ratio: float) -> list[str]:
    """Effects of a form; what is never weak only where the ratio is not small."""
    names = sorted(name for name, kind in EFFECTS.items() if form in kind.forms)
    return [name for name in names if ratio >= 4 or name not in CONSPICUOUS]


def measured(
    scene: Scene, chi2: tuple[float, float], generator: np.random.Generator
) -> ImperfectDraw:
    before, after = (
        record(scene.response(hidden), scene.frequency, generator, AVERAGES)
        for hidden in (NOTHING, scene.hidden)
    )
    return ImperfectDraw(
        form=scene.form,
        nominal=scene.nominal,
        priors=scene.priors,
        sensors=scene.sensors,
        actuators=scene.actuators,
        records=(after,),
        baseline=before,
        true=scene.true,
        gains=scene.gains,
        hidden=scene.hidden,
        chi2=chi2,
    )


def without(scene: Scene) -> tuple[Scene, tuple[float, float]]:
    chi2 = NominalFit(scene).of(scene.response(NOTHING, COARSE)).chi2
    return scene, (chi2, chi2)


def tuned(
    key: Key, scene: Scene, name: str, ratio: float
) -> tuple[Scene, tuple[float, float]] | None:
    """Find a strength by bisection of its logarithm; None where none will do."""
    fit = NominalFit(scene)
    before = fit.of(scene.response(NOTHING, COARSE))

    def excess(strength: float) -> tuple[float, tuple[Scene, tuple[float, float]]]:
        """Of the ratio over 1, as a share of what is asked."""
        hidden = made(key, scene, name, strength)
        after = fit.of(scene.response(hidden, COARSE), before.values)
        share = (after.chi2 / before.chi2 - 1) / (ratio - 1)
        return share, (replace(scene, hidden=hidden), (before.chi2, after.chi2))

    low, high = EFFECTS[name].strengths
    least, weakest = excess(low)
    if least >= 1:
        return weakest if name in CONSPICUOUS else None
    if excess(high)[0] < 1:
        return None
    for _ in range(TRIALS):
        middle = float(np.sqrt(low * high))
        share, scene_and_chi2 = excess(middle)
        if 1 <= share < 1.1:
            return scene_and_chi2
        low, high = (middle, high) if share < 1 else (low, middle)
    return None
