"""Wrong factors that have a name: units taken for each other, a peak for a root mean square."""

import math

KNOWN = {
    "9.81, as of m/s² for g": 9.81,
    "1/9.81, as of g for m/s²": 1 / 9.81,
    "sqrt 2, as of a peak for a root mean square": math.sqrt(2),
    "1/sqrt 2, as of a root mean square for a peak": 1 / math.sqrt(2),
    "2 pi, as of rad/s for Hz": 2 * math.pi,
    "1/(2 pi), as of Hz for rad/s": 1 / (2 * math.pi),
    "1000, as of a unit for its thousandfold": 1e3,
    "1/1000, as of a unit for its thousandth": 1e-3,
    "-1, as of reversed polarity": -1.0,
}
"""Factors by their names."""

WIDTH = 2.5758
"""Standard deviations between which 99 % of a normal distribution lie."""

SHARPEST = 0.1
"""Greatest relative uncertainty of a factor that tells these apart."""


def known_factor(mean: float, standard_deviation: float) -> str:
    """Name of the known wrong factor that an estimate may be; empty where there is none."""
    if not 0 <= standard_deviation <= SHARPEST * abs(mean):
        return ""
    if abs(mean - 1.0) <= WIDTH * standard_deviation:
        return ""  # it may be none at all
    distance = {name: abs(mean - factor) for name, factor in KNOWN.items()}
    nearest = min(distance, key=lambda name: distance[name])
    return nearest if distance[nearest] <= WIDTH * standard_deviation else ""
