"""How alike the errors of neighbouring lines are, by what differs from repeat to repeat."""

import numpy as np
from jaxtyping import Complex

FEWEST_LINES = 16
"""Fewest lines from which it is estimated."""

LAGS = 4
"""Part of all lines to which correlation is followed: a quarter."""


def correlated_lines(deviations: Complex[np.ndarray, "repeat frequency"]) -> float:
    """Number of neighbouring lines that count as one independent line.

    It is the sum of squared correlations over all distances between lines.

    Noise of a windowed force, and whatever else makes a repeat differ from others over a band, is
    in many lines alike. Deviations are scaled to one size at each line; the square of a correlation
    of F lines and n repeats is 1 / (F (n - 1)) too large on average, which is subtracted.

    Parameters
    ----------
    deviations
        Deviation of each repeat from their mean.
    """
    repeats, lines = deviations.shape
    if lines < FEWEST_LINES:
        return 1.0
    size = np.linalg.norm(deviations, axis=0)
    scaled = np.divide(deviations, size, out=np.zeros_like(deviations), where=size > 0)
    power = np.sum(np.abs(np.fft.fft(scaled, 2 * lines)) ** 2, axis=0)
    lags = np.arange(1, lines // LAGS)
    squares = np.abs(np.fft.ifft(power)[lags] / (lines - lags)) ** 2
    return float(1 + 2 * np.sum(squares - 1 / ((lines - lags) * (repeats - 1))))
