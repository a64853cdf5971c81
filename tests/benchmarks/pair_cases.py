"""Verdicts where two listed effects are missing at once, of a model that is exact besides.

What is simulated is the package's own model with both effects, so that a case asks the search
alone: each pair of kinds hides in another way what the other does. Run a part by hand with
`python -m tests.benchmarks.pair_cases FIRST LAST`; see `recorded_rows` for how parts are put
together.
"""

import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import jax
import numpy as np
from numpyro.distributions import Uniform

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement.effects.effect import Effect
from bayes_placement.modes.modes import Modes
from tests.benchmarks.recorded_rows import Rows

ON_STRUCTURE = (
    "point_mass",
    "ground_spring",
    "tuned_absorber",
    "local_stiffness_loss",
    "shear_and_rotary_inertia",
    "axial_preload",
    "compliant_support",
    "rotary_inertia",
    "dimension_error",
    "segment_mass",
    "viscoelastic_modulus",
)
OF_INSTRUMENTS = (
    "reversed_sensor",
    "swapped_sensors",
    "gain_error",
    "time_delay",
    "sensor_mass",
    "low_pass",
    "channel_delay",
    "mount_resonance",
    "misplaced_sensor",
    "frequency_scale",
)

SHARE_OF_INSTRUMENTS = 0.7
"""Share of the pairs of which one is an effect of instruments."""

LEAST_SHOWN = 5.0
"""Deviations of the noise, root mean square, that each effect makes beside the other."""

NOISE, AVERAGES = 0.01, 32
"""Noise over |H|, beside a tenth of that of the median |H| at all lines; and averages."""

PLACES, DRIVEN_AT, TOLERANCE = (0.18, 0.43, 0.67, 0.93), 0.31, 0.008
"""Sensors and actuator over the length, and the tolerance of each [m]."""

LINES, TRIES = 150, 20


class Hidden(NamedTuple):
    """Two effects, values of all that is unknown, and how much each effect shows."""

    effects: tuple[Effect, Effect]
    values: Mapping[str, np.ndarray]
    shown: tuple[float, float]


@dataclass(frozen=True)
class Case:
    """A verdict on two hidden effects, and the time that it took."""

    seed: int
    form: str
    hidden: list[str]
    shown: list[float]
    stated: dict[str, float]
    right: bool
    headline: str
    wall: float

    def __str__(self) -> str:
        found = " + ".join(f"{name} {share:.3f}" for name, share in self.stated.items())
        return (
            f"{self.seed}: {self.form}, {' + '.join(self.hidden)}, shown by {self.shown}; found "
            f"{found or 'nothing'}, {'right' if self.right else 'not'}; {self.wall:.0f} s; "
            f"{self.headline}"
        )


ROWS = Rows(Case, "pair_cases")


@cache
def case(seed: int) -> Case:
    """Ask the pair of a seed, or look it up."""
    return ROWS.told(asked, seed=seed)


def asked(seed: int) -> Case:
    generator = np.random.default_rng(seed)
    form = [*FORMS][seed % len(FORMS)]
    model = experiment(form)
    hidden = pair(model, generator)
    measured = measurement(model, hidden, generator)
    began = time.perf_counter()
    ledger = bp.improve(model, measured)
    kinds = sorted(effect.kind for effect in hidden.effects)
    return Case(
        seed=seed,
        form=form,
        hidden=kinds,
        shown=[round(each, 1) for each in hidden.shown],
        stated={kind: ledger.probabilities[kind] for kind in ledger.verdict},
        right=sorted(ledger.verdict) == kinds,
        headline=ledger.sentence(),
        wall=time.perf_counter() - began,
    )


def bar() -> bp.Experiment:
    modes = bp.beams.bar(20, length=2.0, area=4e-4, ends="fixed-free", **aluminium())
    return placed(modes, 2.0, np.linspace(100.0, 7000.0, LINES))


def beam(ends: str, lowest: float) -> bp.Experiment:
    modes = bp.beams.beam(20, length=0.9, area=3e-4, second_moment=2.5e-9, ends=ends, **aluminium())
    return placed(modes, 0.9, np.geomspace(lowest, 1500.0, LINES))


def aluminium() -> dict[str, object]:
    return {"youngs_modulus": Uniform(6.6e10, 7.4e10), "density": 2700.0}


FORMS = {
    "bar": bar,
    "free beam": lambda: beam("free-free", 30.0),
    "cantilever": lambda: beam("fixed-free", 12.0),
}


def experiment(form: str) -> bp.Experiment:
    return FORMS[form]()


def placed(modes: Modes, length: float, frequency: np.ndarray) -> bp.Experiment:
    """A structure with its instruments."""
    segments = [
        bp.positions.Segment(share * length, within=TOLERANCE) for share in (*PLACES, DRIVEN_AT)
    ]
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(Uniform(0.003, 0.02))),
        sensors=[bp.Sensor(f"s{number + 1}", at=at) for number, at in enumerate(segments[:-1])],
        actuators=[bp.Actuator("a1", at=segments[-1])],
        frequency=frequency,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
    )


def pair(model: bp.Experiment, generator: np.random.Generator) -> Hidden:
    """Draw two effects of other kinds, each of which shows beside the other."""
    while True:
        second = OF_INSTRUMENTS if generator.random() < SHARE_OF_INSTRUMENTS else ON_STRUCTURE
        kinds = [str(generator.choice(names)) for names in (ON_STRUCTURE, second)]
        variants = [suggested(model, kind) for kind in kinds]
        if kinds[0] == kinds[1] or not all(variants):
            continue
        first, other = (each[generator.integers(len(each))] for each in variants)
        for _ in range(TRIES):
            hidden = drawn(model, (first, other), generator)
            if min(hidden.shown) > LEAST_SHOWN:
                return hidden


def suggested(model: bp.Experiment, kind: str) -> Sequence[Effect]:
    """Variants of a kind that a structure may lack; none where it cannot."""
    try:
        return bp.effects.library(model, [kind]).effects
    except bp.InputError:
        return ()


def drawn(
    model: bp.Experiment, effects: tuple[Effect, Effect], generator: np.random.Generator
) -> Hidden:
    """Draw all that is unknown from its prior."""
    both = model + effects[0] + effects[1]
    keys = jax.random.split(jax.random.PRNGKey(int(generator.integers(2**30))), len(both.unknowns))
    values = {
        unknown.name: np.asarray(unknown.distribution.sample(key))
        for unknown, key in zip(both.unknowns, keys, strict=True)
    }
    frf = response(both, values)
    shown = [misfit(frf, response(both.without(effect.name), values)) for effect in effects]
    return Hidden(effects, values, (shown[0], shown[1]))


def response(model: bp.Experiment, values: Mapping[str, np.ndarray]) -> np.ndarray:
    known = {name: value for name, value in values.items() if name in model.unknown}
    return np.asarray(compiled(bp.Experiment.frf)(model.fix(known)))


def deviation(frf: np.ndarray) -> np.ndarray:
    return NOISE * (np.abs(frf) + 0.1 * np.median(np.abs(frf)))


def misfit(frf: np.ndarray, other: np.ndarray) -> float:
    """Root mean square of a difference over the noise; 0 where an FRF is not finite."""
    with np.errstate(invalid="ignore"):
        square = float(np.mean(np.abs((frf - other) / deviation(frf)) ** 2))
    return float(np.sqrt(square)) if np.isfinite(square) else 0.0


def measurement(
    model: bp.Experiment, hidden: Hidden, generator: np.random.Generator
) -> bp.Measurement:
    """What is measured with both effects, with noise by its coherence."""
    frf = response(model + hidden.effects[0] + hidden.effects[1], hidden.values)
    noise = deviation(frf)
    parts = generator.standard_normal((2, *frf.shape)) / np.sqrt(2)
    return bp.Measurement.from_arrays(
        frf + noise * (parts[0] + 1j * parts[1]),
        np.asarray(model.frequency),
        sensors=model.sensor_channels,
        actuators=model.actuator_channels,
        quantity="accelerance",
        coherence=1 / (1 + AVERAGES * (noise / np.abs(frf)) ** 2),
        averages=AVERAGES,
    )


if __name__ == "__main__":
    cases = [case(seed) for seed in range(int(sys.argv[1]), int(sys.argv[2]) + 1)]
    print(f"{sum(one.right for one in cases)} of {len(cases)} pairs right")
