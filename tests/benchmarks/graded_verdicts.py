"""Verdicts on exact models that hide nothing, one effect or two, and what probability they state.

Run a part by hand with `python -m tests.benchmarks.graded_verdicts FAMILY FIRST LAST`; see
`recorded_rows` for how parts are put together.
"""

import sys
import time
from dataclasses import dataclass
from functools import cache

import bayes_placement as bp
from tests.benchmarks.missing_effects import experiment_of
from tests.benchmarks.recorded_rows import Rows
from tests.simulator.graded_draws import faint, graded


@dataclass(frozen=True)
class GradedVerdict:
    """What a structure hides, how much it shows, and each claimed kind with its probability."""

    family: str
    seed: int
    hidden: list[str]
    excess: list[float]
    stated: dict[str, float]
    wall: float
    cpu: float

    def __str__(self) -> str:
        hides = [f"{name} ({x:.3g})" for name, x in zip(self.hidden, self.excess, strict=True)]
        claims = [
            f"{kind} ({share:.3g}{'' if kind in self.hidden else ', WRONG'})"
            for kind, share in self.stated.items()
        ]
        return (
            f"{self.family} {self.seed}: {' + '.join(hides) or 'nothing'}; claimed "
            f"{' + '.join(claims) or 'nothing'}, {self.wall:.0f} s, CPU {self.cpu:.0f} s"
        )


FAMILIES = {"graded": graded, "faint": faint}
"""Structures with many data, and with few."""

ROWS = Rows(GradedVerdict, "graded_verdicts")


@cache
def verdict(family: str, seed: int) -> GradedVerdict:
    """Ask for what a structure hides, or look it up."""
    return ROWS.told(asked_of, family=family, seed=seed)


def asked_of(family: str, seed: int) -> GradedVerdict:
    drawn = FAMILIES[family](seed)
    wall, cpu = time.perf_counter(), time.process_time()
    ledger = bp.improve(*experiment_of(drawn.draw))
    return GradedVerdict(
        family=family,
        seed=seed,
        hidden=list(drawn.hidden),
        excess=list(drawn.excess),
        stated={kind: ledger.probabilities[kind] for kind in ledger.verdict},
        wall=time.perf_counter() - wall,
        cpu=time.process_time() - cpu,
    )


if __name__ == "__main__":
    for number in range(int(sys.argv[2]), int(sys.argv[3]) + 1):
        verdict(sys.argv[1], number)
