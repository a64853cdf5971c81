"""An estimated FRF, what was done to its records, and kinds of excitation that give its spectra."""

import abc
from dataclasses import dataclass

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
        """Spectra of the repeats that the records hold.

        Raises
        ------
        InputError
            If fewer than two repeats are left.
        """


def lines(count: int, rate: float) -> Float[np.ndarray, "frequency"]:
    """Lines [Hz] of a transform of that many samples, without 0 Hz and the Nyquist frequency."""
    frequency = np.fft.rfftfreq(count, 1 / rate)
    return frequency[1 : (count + 1) // 2]
