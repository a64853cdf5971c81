"""Benchmarks on structures that are not quite as drawn: false alarms, power, calibration.

Run with `python -m pytest tests/benchmarks/test_imperfect.py -n 0 -s -m long`, or a part of it with
`-k`, for example `-k "test_verdicts and power and 20"`; `recorded_rows` tells how
parts are put together.
"""

import numpy as np
import pytest
from scipy.stats import norm

from tests.benchmarks.imperfect_cases import QUESTIONS, Case, Scores, case
from tests.benchmarks.imperfect_experiments import given
from tests.simulator.imperfect_draws import draw

DRAWS, BATCH = 40, 10
CALIBRATED = 25
"""Seeds of each question, which together make a hundred cases."""

pytestmark = pytest.mark.long


def summary(question: str, cases: list[Case]) -> int:
    """Print how many are right, and return how many are wrong."""
    right = sum(case.right for case in cases)
    seconds, cpu = ([getattr(case, clock) for case in cases] for clock in ("wall", "cpu"))
    print(
        f"{question}: {right} of {len(cases)} right; median {np.median(seconds):.0f} s (CPU "
        f"{np.median(cpu):.0f} s), longest {max(seconds):.0f} s"
    )
    return len(cases) - right


@pytest.mark.parametrize("first", range(0, DRAWS, BATCH))
@pytest.mark.parametrize("question", QUESTIONS)
def test_verdicts(question, first):
    cases = [case(question, seed) for seed in range(first, first + BATCH)]
    assert summary(f"{question} from {first}", cases) <= QUESTIONS[question].most_wrong


@pytest.mark.parametrize("question", QUESTIONS)
def test_all_verdicts(question):
    cases = [case(question, seed) for seed in range(DRAWS)]
    assert summary(question, cases) <= QUESTIONS[question].most_wrong


def test_intervals_of_90_percent_follow_from_those_of_99():
    drawn = draw(0)
    scores = Scores.of(given(drawn).experiment)
    low, high = drawn.priors["density"]  # uniform
    middle, deviation = 1.2, 0.4

    def value(deviations):
        return low + (high - low) * norm.cdf(middle + deviations * deviation)

    ends = value(norm.ppf(0.005)), value(norm.ppf(0.995))
    for deviations, inside in ((1.64, True), (1.65, False), (-1.64, True), (-1.65, False)):
        is_within = scores.within("structure.modes.density", value(deviations), *ends)
        assert is_within is inside


def test_calibration():
    cases = [case(question, seed) for question in QUESTIONS for seed in range(CALIBRATED)]
    shares = {}
    for measured in cases:
        for name, inside in measured.within.items():
            owner = "effect" if "effects" in name else name.split(".")[0]
            shares.setdefault(owner, []).append(inside)
    for owner, inside in shares.items():
        print(f"{owner}: {sum(inside)} of {len(inside)} within 90 % ({np.mean(inside):.1%})")
    inside = np.concatenate([*shares.values()])
    print(f"all: {inside.sum()} of {inside.size} ({inside.mean():.1%}) in {len(cases)} cases")
    assert len(cases) >= 100
    assert 0.8 <= inside.mean() <= 0.97
