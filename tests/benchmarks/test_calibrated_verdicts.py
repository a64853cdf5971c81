"""Benchmark: what verdicts state as probability is the share of them that is right.

Run with `python -m pytest tests/benchmarks/test_calibrated_verdicts.py -n 0 -s -m long`: from rows
that are recorded, of which a few are computed again. `recorded_rows` tells how all of them are;
imperfect structures are shared with `test_imperfect.py`.
"""

from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.stats import beta

from tests.benchmarks import graded_verdicts
from tests.benchmarks.imperfect_cases import QUESTIONS, case
from tests.benchmarks.recorded_rows import folder

EXACT, IMPERFECT = {"graded": 150, "faint": 150}, 15
"""Structures whose model is exact, of each family; and that are imperfect, of each question."""

BINS = (0.0, 0.5, 0.9, 0.99, 1.0)
SURE = (0.9, 0.99)

pytestmark = pytest.mark.long


class Claim(NamedTuple):
    """A claimed effect: its stated probability, and whether it is there."""

    stated: float
    right: bool


class Bin(NamedTuple):
    """Claims between two stated probabilities: their number, their mean, how many are right."""

    low: float
    high: float
    count: int
    stated: float
    right: int

    @property
    def share(self) -> float:
        return self.right / self.count

    def interval(self) -> tuple[float, float]:
        """Interval of 95 % of the share (Clopper and Pearson, 1934)."""
        wrong = self.count - self.right
        low = beta.ppf(0.025, self.right, wrong + 1) if self.right else 0.0
        high = beta.ppf(0.975, self.right + 1, wrong) if wrong else 1.0
        return float(low), float(high)


def binned(claims: list[Claim]) -> list[Bin]:
    """Claims by stated probability; bins that hold none are left out."""
    stated, right = np.array(claims, dtype=float).reshape(-1, 2).T
    number = np.clip(np.searchsorted(BINS, stated, side="left") - 1, 0, len(BINS) - 2)
    bins = []
    for low, high, inside in ((*BINS[n : n + 2], number == n) for n in range(len(BINS) - 1)):
        if inside.any():
            mean, count = float(stated[inside].mean()), int(inside.sum())
            bins.append(Bin(low, high, count, mean, int(right[inside].sum())))
    return bins


def calibration_error(bins: list[Bin]) -> float:
    """Expected calibration error: mean distance of stated probability and share."""
    total = sum(each.count for each in bins)
    return sum(each.count * abs(each.stated - each.share) for each in bins) / total


def of_exact(family: str) -> list[Claim]:
    verdicts = [graded_verdicts.verdict(family, seed) for seed in range(EXACT[family])]
    return [
        Claim(share, kind in verdict.hidden)
        for verdict in verdicts
        for kind, share in verdict.stated.items()
    ]


def of_imperfect() -> list[Claim]:
    cases = [case(question, seed) for question in QUESTIONS for seed in range(IMPERFECT)]
    return [
        Claim(share, asked.hidden.split()[0] == kind and (asked.right or len(asked.stated) > 1))
        for asked in cases
        for kind, share in asked.stated.items()
    ]


def test_stated_probabilities_are_reliable(tmp_path):
    parts = {
        "exact models, many data": of_exact("graded"),
        "exact models, few data": of_exact("faint"),
        "imperfect structures": of_imperfect(),
    }
    claims = [claim for part in parts.values() for claim in part]
    for name, part in (parts | {"all": claims}).items():
        told(name, binned(part))
    print(
        draw((folder() or tmp_path) / "reliability.png", {n: binned(c) for n, c in parts.items()})
    )
    bins = binned(claims)
    assert calibration_error(bins) <= 0.05
    for sure in bins:
        if (sure.low, sure.high) == SURE:
            assert sure.share >= 0.85


@pytest.mark.parametrize("seed", range(0, EXACT["faint"], 30))
def test_a_recorded_verdict_is_that_of_this_search(seed):
    recorded = graded_verdicts.verdict("faint", seed)
    again = graded_verdicts.told("faint", seed)
    assert again.hidden == recorded.hidden
    assert again.stated == pytest.approx(recorded.stated, abs=1e-3)


def told(name: str, bins: list[Bin]) -> None:
    print(f"{name}: expected calibration error {calibration_error(bins):.3f}")
    for each in bins:
        low, high = each.interval()
        print(
            f"  said with {each.low:g} to {each.high:g} ({each.stated:.3f} in the mean): "
            f"{each.right} of {each.count} right ({each.share:.2f}, 95 % {low:.2f} to {high:.2f})"
        )


def draw(path, parts):
    """Share of right claims over stated probability, with intervals of 95 %."""
    figure, ax = plt.subplots(figsize=(4.5, 4.8), layout="constrained")
    ax.plot([0, 1], [0, 1], color="0.6", linewidth=0.8, label="reliable")
    for (name, bins), marker in zip(parts.items(), "osd", strict=True):
        share = np.array([each.share for each in bins])
        ends = np.array([each.interval() for each in bins]).T
        reach = np.maximum([share - ends[0], ends[1] - share], 0.0)
        count = sum(each.count for each in bins)
        stated = [each.stated for each in bins]
        ax.errorbar(stated, share, reach, fmt=marker, capsize=3, label=f"{name}, {count} claims")
    ax.set(xlabel="stated probability [1]", ylabel="share of claims that are right [1]")
    figure.legend(loc="outside upper center")  # inside it would cover intervals
    figure.savefig(path, dpi=130)
    plt.close(figure)
    return path


def test_probabilities_that_are_not_reliable_are_told():
    random = np.random.default_rng(1)
    stated = random.uniform(0.4, 1.0, 400)
    honest = [Claim(p, random.uniform() < p) for p in stated]
    boastful = [Claim(p, random.uniform() < p - 0.2) for p in stated]
    assert calibration_error(binned(honest)) < 0.05 < calibration_error(binned(boastful))
    assert sum(each.count for each in binned(honest)) == 400
