"""Verdicts on imperfect structures, one case at a time, each told as it ends.

Run a part by hand with `python -m tests.benchmarks.imperfect_cases QUESTION FIRST LAST`; see
`recorded_rows` for how parts are put together.
"""

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

import bayes_placement as bp
from bayes_placement.inference.estimates import scalars
from bayes_placement.inference.residuals_of_state import coordinates_of
from tests.benchmarks.imperfect_experiments import given
from tests.benchmarks.recorded_rows import Rows
from tests.simulator.imperfect_draws import ImperfectDraw, draw

INTERVAL_99, INTERVAL_90 = 2.5758, 1.6449
"""Standard deviations between which as many percent of a normal distribution lie."""


@dataclass(frozen=True)
class Question:
    """What is hidden, how much it shows, and whether the baseline is given; most errors of 40."""

    name: str | None
    ratios: tuple[float, float]
    baseline: bool
    most_wrong: int

    def draw(self, seed: int) -> ImperfectDraw:
        low, high = np.log(self.ratios)
        ratio = float(np.exp(np.random.default_rng([seed, 8]).uniform(low, high)))
        return draw(seed, self.name, ratio)


QUESTIONS = {
    "nothing": Question(None, (4.0, 4.0), baseline=False, most_wrong=2),
    "power": Question("any", (4.0, 30.0), baseline=False, most_wrong=6),
    "since_4": Question("any", (4.0, 4.0), baseline=True, most_wrong=2),
    "since_1.2": Question("any", (1.2, 1.2), baseline=True, most_wrong=2),
}


@dataclass(frozen=True)
class Case:
    """A verdict, its time, and which true values lie within their 90 % intervals.

    What is claimed comes with its stated probability.
    """

    question: str
    seed: int
    form: str
    hidden: str
    ratio: float
    verdict: list[str]
    stated: dict[str, float]
    right: bool
    wall: float
    cpu: float
    within: dict[str, bool]

    def __str__(self) -> str:
        outside = [name for name, inside in self.within.items() if not inside]
        return (
            f"{self.question} {self.seed}: {self.form}, {self.hidden}, ratio {self.ratio:.2f}; "
            f"found {' + '.join(self.verdict) or 'nothing'}, {'right' if self.right else 'WRONG'}, "
            f"{self.wall:.0f} s, CPU {self.cpu:.0f} s; of {len(self.within)} true values outside "
            f"of 90 %: {', '.join(outside) or 'none'}"
        )


ROWS = Rows(Case, "imperfect_cases")


@cache
def case(question: str, seed: int) -> Case:
    """Ask a question of a seed, or look it up."""
    return ROWS.told(asked_of, question=question, seed=seed)


def asked_of(question: str, seed: int) -> Case:
    asked = QUESTIONS[question]
    drawn = asked.draw(seed)
    study = given(drawn)
    before = {"baseline": study.baseline} if asked.baseline else {}
    wall, cpu = time.perf_counter(), time.process_time()
    ledger = bp.improve(study.experiment, study.measured, **before)
    return Case(
        question=question,
        seed=seed,
        form=drawn.form,
        hidden=in_words(drawn),
        ratio=drawn.ratio,
        verdict=list(ledger.verdict),
        stated={kind: ledger.probabilities[kind] for kind in ledger.verdict},
        right=is_right(ledger, drawn),
        wall=time.perf_counter() - wall,
        cpu=time.process_time() - cpu,
        within=within(ledger, drawn),
    )


def in_words(drawn: ImperfectDraw) -> str:
    pairs = (f"{name} {value}" for name, value in drawn.hidden.pairs)
    return " ".join([drawn.hidden.name, *pairs])


def is_right(ledger, drawn: ImperfectDraw) -> bool:
    """Whether the verdict is the truth; where it is about a sensor, about the right one."""
    hidden = drawn.hidden
    if hidden.name == "nothing":
        return not ledger.verdict
    sensor = dict(hidden.pairs).get("sensor", "")
    setting = ledger.steps[-1].setting.replace(",", " ").split()
    return ledger.verdict == (hidden.name,) and (not sensor or sensor in setting)


def within(ledger, drawn: ImperfectDraw) -> dict[str, bool]:
    """Whether each true value lies within its 90 % interval; of the effect, where it is named."""
    step = ledger.steps[-1]
    truth, scores = true_values(drawn), Scores.of(step.experiment)
    if is_right(ledger, drawn):
        words = true_effect(drawn)
        named = step.parameters_of_added() if words else {}
        truth |= {
            name: words[unknown.word] for name, unknown in named.items() if unknown.word in words
        }
    return {
        name: scores.within(name, value, step.parameters[name].low, step.parameters[name].high)
        for name, value in truth.items()
        if name in step.parameters
    }


@dataclass(frozen=True)
class Scores:
    """Values of each unknown at the same standard normal coordinates.

    Intervals of the package are normal in coordinates in which the prior is standard normal, so
    that those of 99 % tell those of 90 %.
    """

    normal: np.ndarray
    tables: dict[str, np.ndarray]

    @classmethod
    def of(cls, experiment) -> "Scores":
        coordinates = coordinates_of(experiment)
        normal = np.linspace(-7.0, 7.0, 5601)
        points = np.tile(normal[:, None], (1, coordinates.dimension))
        named = coordinates.named(points)
        tables = {
            element: np.ravel(values)
            for name, table in named.items()
            for element, values in scalars(name, table[None])
        }
        return cls(normal, tables)

    def within(self, name: str, value: float, *ends_of_99: float) -> bool:
        """Whether a value lies within the interval of 90 %, from the ends of that of 99 %."""
        low, high = (self.of_value(name, end) for end in ends_of_99)
        half = (high - low) / 2 * INTERVAL_90 / INTERVAL_99
        return bool(abs(self.of_value(name, value) - (low + high) / 2) <= half)

    def of_value(self, name: str, value: float) -> float:
        return float(np.interp(value, self.tables[name], self.normal))


def true_values(drawn: ImperfectDraw) -> dict[str, float]:
    """True values of what is unknown of the structure and its instruments.

    Of a stiffness that varies, its mean: that is what all modes feel together. Forgotten masses
    count as density for the same reason.
    """
    true = drawn.true
    forgotten = sum(mass for _, mass in true.masses)
    values = {
        "structure.modes.youngs_modulus": true.youngs_modulus * float(np.mean(true.pieces)),
        "structure.modes.density": true.density * (1 + forgotten / true.mass),
        "structure.damping.ratio": true.damping_ratio,
    }
    moved = dict(drawn.hidden.pairs).get("sensor") if "misplaced" in drawn.hidden.name else None
    for side, group in (("sensor", drawn.sensors), ("actuator", drawn.actuators)):
        for instrument in group:
            if instrument.name != moved:
                values |= coordinates(f"{side}.{instrument.name}.position", instrument.true)
    return values


OURS = {"share": "loss"}


def true_effect(drawn: ImperfectDraw) -> dict[str, float]:
    """True values of the effect, by the words of its unknowns."""
    values: dict[str, float] = {}
    for name, value in drawn.hidden.pairs:
        if not isinstance(value, str | int):
            values |= coordinates(OURS.get(name, name), value)
    return values


def coordinates(name: str, place) -> Iterator[tuple[str, float]]:
    """A number by its name, or a place by those of its coordinates."""
    if isinstance(place, tuple):
        yield from ((f"{name}.{axis}", at) for axis, at in zip("xy", place, strict=True))
    else:
        yield name, place


if __name__ == "__main__":
    asked, first, last = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    cases = [case(asked, number) for number in range(first, last + 1)]
    print(f"{asked}: {sum(case.right for case in cases)} of {len(cases)} right")
