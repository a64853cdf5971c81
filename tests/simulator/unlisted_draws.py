"""Measurements of random structures whose hidden effect may be anything, by seed.

Independent of bayes_placement.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize

from tests.simulator.hidden_structures import Record, record
from tests.simulator.imperfect_scenes import FLAWS, NO_FLAWS
from tests.simulator.law_identity import is_told
from tests.simulator.unlisted_effects import KINDS, Hidden, response
from tests.simulator.unlisted_scenes import COARSE, FORMS, SHARES, Scene, drawn

MISFIT = (2.0, 500.0)
"""Chi2 per datum of the best fit of the structure as drawn, log-uniform."""

EFFECTS = (1, 2, 1, 0, 1)
"""Numbers of effects, which take turns with the seed: a fifth two, a fifth none."""

WEAKEST = 1e-8
CLOSE = 0.15
"""Greatest difference of the logarithm of the excess of chi2 from the one asked for."""

SAME_LAW = 8
"""Dimensions drawn for one law before another is drawn."""

ATTEMPTS = 80
AVERAGES = (16, 32)

Key = tuple[int, ...]


@dataclass(frozen=True)
class UnlistedDraw:
    """What is given to the engineer, and the truth."""

    scene: Scene
    hidden: tuple[Hidden, ...]
    record: Record
    chi2: float  # expected, per datum, of the best fit of the structure as drawn

    @property
    def form(self) -> str:
        return self.scene.form


def draw(seed: int, kinds: Sequence[str] | None = None) -> UnlistedDraw:
    """Draw a structure that hides effects of these kinds; where none are told, of any.

    The strength of each is such that the best fit of the structure as drawn has a chi2 per datum
    from 2 to 500. A law is drawn anew where one of fewer elements fits as well.
    """
    chooser = np.random.default_rng([seed, 7])
    if kinds is None:
        shares = [kind.share for kind in KINDS.values()]
        kinds = chooser.choice(list(KINDS), EFFECTS[seed % len(EFFECTS)], p=shares).tolist()
    form = str(chooser.choice(*possible(kinds)))
    for attempt in range(ATTEMPTS):
        key = (seed, attempt)
        scene = drawn(key, form)
        hidden = tuned(key, scene, kinds)
        if hidden is not None:
            chi2 = scene.best_fit(response(scene, hidden, COARSE)).chi2
            if not hidden or MISFIT[0] <= chi2 <= MISFIT[1]:
                return measured(scene, hidden, chi2, np.random.default_rng([*key, 1]))
    raise ValueError(f"No strength of {kinds} gives what is asked for, seed {seed}.")


def nothing(seed: int, imperfect: bool) -> UnlistedDraw:
    """Draw a structure with nothing missing, exactly as drawn or not quite."""
    sizes = FLAWS if imperfect else NO_FLAWS
    form = str(np.random.default_rng([seed, 8]).choice(*possible([])))
    key = (seed, 1000)
    scene = drawn(key, form, sizes)
    chi2 = scene.best_fit(response(scene, (), COARSE)).chi2
    return measured(scene, (), chi2, np.random.default_rng([*key, 1]))


def possible(kinds: Sequence[str]) -> tuple[list[str], None, bool, list[float]]:
    """Arguments of `choice`: forms of which all kinds are known, with their shares."""
    forms = [form for form in FORMS if all(form in KINDS[kind].forms for kind in kinds)]
    whole = sum(SHARES[form] for form in forms)
    return forms, None, True, [SHARES[form] / whole for form in forms]


def measured(scene: Scene, hidden, chi2: float, generator) -> UnlistedDraw:
    averages = int(generator.choice(AVERAGES))
    exact = response(scene, hidden)
    return UnlistedDraw(
        scene=scene,
        hidden=tuple(hidden),
        record=record(exact, scene.frequency, generator, averages, relative=scene.noise),
        chi2=chi2,
    )


def tuned(key: Key, scene: Scene, kinds: Sequence[str]) -> tuple[Hidden, ...] | None:
    """Effects that each show as much as was asked for; None where no strength will do."""
    seed, attempt = key
    targets = np.random.default_rng([*key, 2]).uniform(*np.log(MISFIT), len(kinds))
    hidden = []
    for number, (kind, target) in enumerate(zip(kinds, np.exp(targets).tolist(), strict=True)):
        law = KINDS[kind].laws(np.random.default_rng([seed, attempt // SAME_LAW, 5, number]))
        made = KINDS[kind].make(np.random.default_rng([*key, 4, number]), scene, law)
        strength = strengthened(scene, made, target)
        if strength is None:
            return None
        hidden.append(made.of_strength(strength))
    if not apart(scene, hidden) or not all(is_told(scene, effect) for effect in hidden):
        return None
    return tuple(hidden)


def strengthened(scene: Scene, made: Hidden, target: float) -> float | None:
    """Strength whose best nominal fit has the chi2 asked for: bisection of the logarithm.

    A fit is no worse than all else true, so that the search begins where that is the target.
    """

    def excess(strength: float) -> float:
        exact = response(scene, [made.of_strength(strength)], COARSE)
        return float(np.log(max(scene.best_fit(exact).chi2 - 1, 1e-6) / (target - 1)))

    low = begun(scene, made, target)
    while low is not None and excess(min(2 * low, made.most)) < 0:
        low = 2 * low if 2 * low < made.most else None
    high = 2 * (low or 0.0)
    while low is not None and high / low > 1.02:
        middle = float(np.sqrt(low * high))
        above = excess(middle)
        if abs(above) < CLOSE and middle <= made.most:
            return middle
        low, high = (middle, high) if above < 0 else (low, middle)
    return None


def begun(scene: Scene, made: Hidden, target: float) -> float | None:
    """Strength whose chi2 with all else true is the target."""
    without = response(scene, (), COARSE)

    def excess(log_strength: float) -> float:
        exact = response(scene, [made.of_strength(np.exp(log_strength))], COARSE)
        square = np.mean(np.abs(exact - without) ** 2 / scene.error(exact) ** 2)
        return float(np.log(square / (target - 1)))

    low, high = np.log([WEAKEST, made.most])
    if not excess(low) < 0 < excess(high):
        return None
    return float(np.exp(scipy.optimize.bisect(excess, low, high, xtol=0.02)))


def apart(scene: Scene, hidden: Sequence[Hidden]) -> bool:
    """Whether two effects are at places a tenth of the length apart, and not both of the whole."""
    if len(hidden) < 2:
        return True
    first, second = (np.array(effect.places, dtype=float) for effect in hidden)
    if not first.size or not second.size:
        return hidden[0].kind != hidden[1].kind
    first, second = first.reshape(len(first), -1), second.reshape(len(second), -1)
    gaps = np.linalg.norm(first[:, None] - second[None], axis=-1)
    return bool(gaps.min() > 0.1 * scene.nominal.length)
