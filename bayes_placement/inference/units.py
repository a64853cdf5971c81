"""Numbers in the units in which people read them: mm, %, GPa; files stay in SI."""

from typing import NamedTuple

import numpy as np

PERCENT = ("ratio", "damping_ratio", "loss_factor", "loss", "drift", "size", "error", "change")
"""Fields without unit that are stated in percent."""

MULTIPLES = {
    "m": ((0.0, 1e3, "mm"), (10.0, 1.0, "m")),
    "Pa": ((0.0, 1.0, "Pa"), (1e5, 1e-6, "MPa"), (1e8, 1e-9, "GPa")),
    "kg": ((0.0, 1e3, "g"), (0.1, 1.0, "kg")),
    "s": ((0.0, 1e6, "µs"), (1e-3, 1e3, "ms"), (1.0, 1.0, "s")),
    "N/m": ((0.0, 1.0, "N/m"), (1e4, 1e-3, "kN/m"), (1e7, 1e-6, "MN/m")),
    "N": ((0.0, 1.0, "N"), (1e4, 1e-3, "kN")),
    "rad": ((0.0, 180 / np.pi, "°"),),
}
"""By SI unit: from which size on a factor and a unit are taken."""

POWERS = str.maketrans("234", "²³⁴")
"""Powers of units as people write them: kg/m³."""

SMALL, LARGE = 1e-4, 1e6
"""Sizes below and from which a number is written with a power of ten, a small one unless its digits
end before."""

MOST_DECIMALS = 12


def three_digits(value: float) -> str:
    """Write a number with three digits, one of a thousand and more in full: 2137, 91.7, 1.00."""
    return f"{value:.0f}" if 1e2 <= abs(value) < 1e6 else f"{value:#.3g}"


def probability_in_words(share: float) -> str:
    """Write a probability with two digits; what is below a thousandth only as such."""
    return f"probability {share:.2g}" if share >= 1e-3 else "probability below 0.001"


class ReadableUnit(NamedTuple):
    """A unit for people."""

    factor: float
    """What a number in SI is multiplied by."""
    name: str
    """The unit; empty for a plain number."""

    def number(self, value: float, deviation: float) -> str:
        """Write a number in SI in this unit, to the second digit of its standard deviation."""
        return _written(value * self.factor, deviation * self.factor, value * self.factor)

    def spread(self, deviation: float, mean: float = 0.0) -> str:
        """Write a standard deviation in SI in this unit, as the mean beside it is written."""
        scaled = deviation * self.factor
        return _written(scaled, scaled, mean * self.factor)


def _written(value: float, deviation: float, mean: float) -> str:
    if not np.isfinite(value):
        return "-"
    if deviation == 0:
        return f"{value:.7g}"
    is_small, is_large = abs(mean) < SMALL and deviation < SMALL, abs(mean) >= LARGE
    if deviation > 0 and (is_small or is_large):
        return _with_power(value, deviation)
    return f"{value:.{decimals(deviation)}f}"


def _with_power(value: float, deviation: float) -> str:
    """Write a number as 8.588e-9 or 2.910e9: a row of zeros, or of ten digits, is misread."""
    if value == 0:
        return "0"
    digits = 1 + np.floor(np.log10(abs(value))) - np.floor(np.log10(deviation))
    number, power = f"{value:.{max(int(digits), 0)}e}".split("e")
    return f"{number}e{int(power)}"


def readable(unit: str, field: str, size: float) -> ReadableUnit:
    """Return the unit in which people read a number.

    The last word of its name distinguishes shares from other numbers without unit; its size is the
    greatest absolute value.
    """
    if unit in ("", "1"):
        return ReadableUnit(100.0, "%") if field in PERCENT else ReadableUnit(1.0, "")
    steps = [
        step
        for step in MULTIPLES.get(unit, ((0.0, 1.0, unit.translate(POWERS)),))
        if size >= step[0]
    ]
    _, factor, name = steps[-1]
    return ReadableUnit(factor, name)


def percent(share: float) -> str:
    """Write a share in percent with two digits, or with all before the point."""
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"


def decimals(deviation: float) -> int:
    """Decimals that show two digits of a standard deviation; at most twelve."""
    if not (np.isfinite(deviation) and deviation > 0):
        return 4
    return int(np.clip(1 - np.floor(np.log10(deviation)), 0, MOST_DECIMALS))
