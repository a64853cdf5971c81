"""An estimated FRF and what was done to its records, the spectra of excitations, and estimators."""

import abc
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from ..._shared.reprs import noun_html
from ...effects.exponential_window import ExponentialWindow
from ...experiment.measurement import Measurement
from .records import Records, Samples


class EstimateWarning(UserWarning):
    """A warning about FRFs that were estimated from time records.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore", bp.time_records.EstimateWarning)
    ...     by_hammer = bp.time_records.Impacts(duration=1.0, before=0.02)
    """


@dataclass(frozen=True, eq=False, kw_only=True)
class Processing(abc.ABC):  # noqa: B024, it has fields alone
    """What was done to records, what was left out, and reasons to doubt, a sentence for each.

    The time constant [s] is of an exponential window on force and response.
    """

    done: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    time_constant: float | None = None


@dataclass(frozen=True, eq=False)
class Estimate(Processing):
    """FRFs that were estimated from time records.

    Parameters
    ----------
    measurement
        FRFs with coherence, number of averages and the variance of each line, which
        `noise.FromVariance` reads.
    estimator
        `H1`, `H2` or `Hv`.
    repeats
        Hits or segments that were used.
    scatter
        Variance of each line by its own repeats alone, of shape (sensor, actuator, frequency).
    done, left_out, warnings, time_constant
        See `Processing`.

    Examples
    --------
    >>> force = np.random.default_rng(0).standard_normal(4096)
    >>> labels = {"quantity": "acceleration", "actuator": "a1", "sensors": ["s1"]}
    >>> by_shaker = bp.time_records.Continuous(segment=0.5)
    >>> estimate = bp.time_records.frf(force, [2 * force], 512.0, excitation=by_shaker, **labels)
    >>> estimate.estimator, estimate.repeats
    ('H1', 31)
    """

    measurement: Measurement
    estimator: str
    repeats: int
    scatter: Float[np.ndarray, "sensor actuator frequency"]

    @property
    def effects(self) -> tuple[ExponentialWindow, ...]:
        """Effects that the windows have on the FRFs, known: `experiment + effect` for each.

        An exponential window is a damping that the structure does not have.
        """
        return () if self.time_constant is None else (ExponentialWindow(1 / self.time_constant),)

    def __repr__(self) -> str:
        """Say what was estimated."""
        return f"Estimate by {self.estimator} from {self.repeats} repeats: {self.measurement!r}"

    _repr_html_ = noun_html

    def __str__(self) -> str:
        """Say what was estimated, from what, and its warnings."""
        done = "".join(f", {words}" for words in self.done)
        return "\n".join(
            [
                str(self.measurement),
                f"By {self.estimator} from {self.repeats} repeats{done}.",
                *(f"- {sentence}" for sentence in (*self.left_out, *self.warnings)),
            ]
        )


@dataclass(frozen=True, eq=False)
class Spectra(Processing):
    """Spectra of force and responses in every repeat, all in one unit of theirs, at lines [Hz].

    `averages` is the number of independent repeats that they are worth, fewer where they overlap;
    `correlated_lines` that of neighbouring lines that count as one, since a window correlates their
    errors; `segment_window` cuts segments out of a longer record.
    """

    frequency: Float[np.ndarray, "frequency"]
    force: Complex[np.ndarray, "repeat frequency"]
    response: Complex[np.ndarray, "sensor repeat frequency"]
    averages: float
    correlated_lines: float
    segment_window: Samples | None = None


class Excitation(abc.ABC):
    """A kind of excitation, and how its records are cut and windowed."""

    @abc.abstractmethod
    def spectra(self, records: Records) -> Spectra:
        """Spectra of the repeats that the records hold; fewer than two are refused."""


def lines(count: int, rate: float) -> Float[np.ndarray, "frequency"]:
    """Lines [Hz] of a transform of that many samples, without 0 Hz and the Nyquist frequency."""
    frequency = np.fft.rfftfreq(count, 1 / rate)
    return frequency[1 : (count + 1) // 2]


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
