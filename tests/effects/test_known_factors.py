"""Known wrong factors: named where an estimate is one of them within its uncertainty."""

import math

import pytest

from bayes_placement import effects
from bayes_placement.effects.gain_error import known_factor


@pytest.mark.parametrize(
    ("mean", "deviation", "beginning"),
    [
        (9.80, 0.01, "9.81, as of m/s² for g"),
        (0.1019, 0.0001, "1/9.81"),
        (math.sqrt(2) + 0.02, 0.01, "sqrt 2"),
        (0.7071, 0.001, "1/sqrt 2"),
        (6.3, 0.01, "2 pi"),
        (0.159, 0.001, "1/(2 pi)"),
        (998.0, 1.0, "1000"),
        (1.001e-3, 1e-6, "1/1000"),
        (-1.0, 0.01, "-1"),
        (9.7, 0.02, ""),
        (1.2, 0.01, ""),
        (9.0, 3.0, ""),  # tells nothing apart
        (0.886, 0.085, ""),  # may be 1 as well as 1/sqrt 2
    ],
)
def test_a_factor_is_named_within_its_uncertainty(mean, deviation, beginning):
    named = known_factor(mean, deviation)
    assert named.startswith(beginning)
    assert bool(named) == bool(beginning)


def test_a_gain_error_says_which_factor_it_is():
    error = effects.gain_error("s1", 0.1)
    assert error.remark({"error": (8.81, 0.01)}) == "a factor of 9.81, as of m/s² for g"
    assert error.remark({"error": (0.1, 0.01)}) == ""
    assert error.remark({}) == ""
    assert effects.point_mass(0.3, 0.1).remark({"mass": (9.81, 0.01)}) == ""
