"""Verdicts where the model is wrong as a whole, one case at a time, each told as it ends.

Run a part by hand with `python -m tests.benchmarks.crude_cases QUESTION FIRST LAST`; see
`recorded_rows` for how parts are put together.
"""

import sys
import time
from dataclasses import dataclass
from functools import cache

import bayes_placement as bp
from tests.benchmarks.imperfect_cases import in_words, is_right
from tests.benchmarks.imperfect_experiments import given
from tests.benchmarks.recorded_rows import Rows
from tests.simulator.crude_draws import CrudeDraw, draw

QUESTIONS = {"unchanged": (False, True), "changed": (True, True), "alone": (False, False)}
"""Whether something came since the baseline, and whether the baseline is given."""

NAMES = {
    "support": {
        "compliant_support",
        "soft_support",
        "ground_spring",
        "attached: lossy spring",
        "fractional_mount",  # of a small order that is a spring with a loss as well
        "foundation",
    },
    "length": {"dimension_error", "beyond_prior"},
    "thickness": {"dimension_error", "beyond_prior"},
    "stiffener": set[str](),
    "mesh": set[str](),
}
"""Names that a fault of the drawing may be told by, where there is no baseline."""

SURE = 0.9


@dataclass(frozen=True)
class Case:
    """A verdict, what is hidden, and the time; what is claimed with its stated probability."""

    question: str
    seed: int
    form: str
    fault: str
    hidden: str
    shift: float
    chi2: list[float]
    stated: dict[str, float]
    right: bool
    wrong: list[str]  # names told as sure that are not right
    headline: str
    wall: float

    def __str__(self) -> str:
        found = " + ".join(f"{name} {share:.3f}" for name, share in self.stated.items())
        return (
            f"{self.question} {self.seed}: {self.form}, {self.fault}; {self.hidden}, shift "
            f"{self.shift:.3f}; found {found or 'nothing'}, {'right' if self.right else 'not'}, "
            f"wrong {self.wrong}; chi2 {self.chi2}; {self.wall:.0f} s; {self.headline}"
        )


ROWS = Rows(Case, "crude_cases")


@cache
def case(question: str, seed: int) -> Case:
    """Ask a question of a seed, or look it up."""
    return ROWS.told(asked_of, question=question, seed=seed)


def asked_of(question: str, seed: int) -> Case:
    is_changed, has_baseline = QUESTIONS[question]
    drawn = draw(seed, is_changed)
    study = given(drawn)
    before = {"baseline": study.baseline} if has_baseline else {}
    began = time.perf_counter()
    ledger = bp.improve(study.experiment, study.measured, **before)
    stated = {kind: ledger.probabilities[kind] for kind in ledger.verdict}
    right = is_right(ledger, drawn)
    return Case(
        question=question,
        seed=seed,
        form=drawn.form,
        fault=drawn.fault,
        hidden=in_words(drawn),
        shift=drawn.shift,
        chi2=[float(f"{step.chi2_per_datum:.3g}") for step in ledger.steps],
        stated=stated,
        right=right,
        wrong=wrong_names(stated, drawn, has_baseline),
        headline=ledger.sentence(),
        wall=time.perf_counter() - began,
    )


def wrong_names(stated: dict[str, float], drawn: CrudeDraw, has_baseline: bool) -> list[str]:
    """Names told with at least `SURE` that are neither what came nor, alone, the fault."""
    right = {drawn.hidden.name} | (set() if has_baseline else NAMES[drawn.fault])
    return [name for name, share in stated.items() if share >= SURE and name not in right]


if __name__ == "__main__":
    asked, first, last = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    cases = [case(asked, number) for number in range(first, last + 1)]
    print(f"{asked}: {sum(one.right for one in cases)} of {len(cases)} right")
    print(f"sure and wrong: {[(one.seed, one.wrong) for one in cases if one.wrong]}")
