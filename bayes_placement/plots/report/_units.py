"""Numbers of tables rounded to what their deviation lets one see."""

import numpy as np

from ...inference.summary import INTERVAL
from ...inference.units import decimals


def rounded(value: float, spread: float) -> float:
    """Round a number to the second digit of its standard deviation; as it is where that is zero."""
    return round(value, decimals(spread)) if np.isfinite(spread) and spread > 0 else value


def rounded_summary(draws: np.ndarray) -> tuple[float, float, float, float]:
    """Mean, standard deviation and both ends of the 95 % interval of draws, rounded."""
    spread = float(draws.std())
    numbers = (draws.mean(), *np.quantile(draws, INTERVAL))
    mean, low, high = (rounded(float(number), spread) for number in numbers)
    return mean, float(f"{spread:.2g}"), low, high
