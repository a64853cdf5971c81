"""Estimators of the FRF from repeats, their coherence, their variance, and how alike lines are."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

RepeatedSpectra = Float[np.ndarray, "*repeat frequency"]
ComplexRepeatedSpectra = Complex[np.ndarray, "*repeat frequency"]


class Products(NamedTuple):
    """Sums over repeats: |X|^2, conj(X) Y and |Y|^2 of force X and response Y."""

    force: RepeatedSpectra
    cross: ComplexRepeatedSpectra
    response: RepeatedSpectra


def h1(products: Products) -> ComplexRepeatedSpectra:
    """Return Gxy / Gxx, which noise on the response does not bias."""
    return products.cross / products.force


def h2(products: Products) -> ComplexRepeatedSpectra:
    """Return Gyy / Gyx, which noise on the force does not bias."""
    return products.response / np.conj(products.cross)


def hv(products: Products) -> ComplexRepeatedSpectra:
    """Geometric mean of H1 and H2: total least squares with both signals scaled to one size.

    Rocklin, Crowley and Vold, A comparison of H1, H2 and Hv frequency response functions, IMAC 3
    (1985) 272.
    """
    phase = products.cross / np.abs(products.cross)
    return np.sqrt(products.response / products.force) * phase


ESTIMATORS: Mapping[str, Callable[[Products], ComplexRepeatedSpectra]] = {
    "H1": h1,
    "H2": h2,
    "Hv": hv,
}


def products(
    force: Complex[np.ndarray, "repeat frequency"],
    response: Complex[np.ndarray, "repeat frequency"],
) -> Products:
    """Products of force and response in each repeat."""
    return Products(np.abs(force) ** 2, np.conj(force) * response, np.abs(response) ** 2)


def summed(repeats: Products) -> Products:
    """Return the sums over repeats."""
    return Products(*(values.sum(axis=0) for values in repeats))


def coherence(total: Products) -> Float[np.ndarray, "frequency"]:
    """Ordinary coherence |Gxy|^2 / (Gxx Gyy)."""
    return np.minimum(np.abs(total.cross) ** 2 / (total.force * total.response), 1.0)


def scatter(
    estimator: Callable[[Products], ComplexRepeatedSpectra], repeats: Products, averages: float
) -> Float[np.ndarray, "frequency"]:
    """Variance E|error|^2 of an estimate by the jackknife: one repeat left out at a time.

    With n repeats of which `averages` are independent it is
    (n - 1)^2 mean|H_k - mean H_k|^2 / (averages - 1), which for independent ones is that of
    Thomson and Chave (1991). It holds for any estimator, and where repeats differ in strength.

    The estimator gives an FRF from sums over repeats, of whose products there is one each.
    """
    without = deviations(estimator, repeats)
    spread = np.mean(np.abs(without) ** 2, axis=0)
    return np.asarray((len(without) - 1) ** 2 * spread / (averages - 1))


def deviations(
    estimator: Callable[[Products], ComplexRepeatedSpectra], repeats: Products
) -> Complex[np.ndarray, "repeat frequency"]:
    """Estimates without one repeat at a time, from their mean."""
    without = estimator(Products(*(values.sum(axis=0) - values for values in repeats)))
    return without - without.mean(axis=0)


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
