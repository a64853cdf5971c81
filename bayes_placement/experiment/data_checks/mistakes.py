"""Mistakes of a whole record: what was made of the right FRFs, how likely, and what mends it."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Shaped
from scipy.special import logsumexp

from ..quantities import QUANTITIES, quantity_of

Records = Complex[np.ndarray, "pair frequency"]
Model = Complex[np.ndarray, "draw pair frequency"]
Frequency = Float[np.ndarray, "frequency"]
Values = Float[np.ndarray, "*draw pair frequency"]
Change = Callable[[Values], Values]

DECIBEL = np.log(10.0) / 20
"""Natural logarithm of the amplitude in a decibel."""

DEGREE = np.pi / 180


class Mistake(NamedTuple):
    """What was made of the right FRFs."""

    words: str
    """What the FRFs look like, after "look"."""
    remedy: str
    """The line that mends it."""
    log_size: Callable[[Records, Model, Frequency], Values] = lambda frf, model, frequency: np.log(
        np.abs(frf)
    )
    """Natural logarithm of the right amplitude, by the record, the model and the frequency [Hz];
    NaN where no amplitude gives such a record."""
    log_slope: Change = np.zeros_like
    """Logarithm of the change of that by that of log |record|."""
    phase: Change = lambda phase: phase
    """What the mistake makes of a phase [rad]."""
    axis: float = 1.0
    """Frequencies of the record over the right ones."""
    is_of_parts: bool = False
    """Whether one sensor or one actuator alone may have it."""
    turns_time: bool = False
    """Whether it turns the sense of time alone, which lines away from resonances do not tell."""


AS_GIVEN = Mistake("as given", "")
"""No mistake."""


def mistakes(quantity: str) -> list[Mistake]:
    """Every mistake that a record of a quantity may have."""
    return [*_OF_NUMBERS, *_OF_AXES, *(_derivative(quantity, power) for power in (-2, -1, 1, 2))]


def swapped(first: str, second: str, side: str = "") -> Mistake:
    """Two transducers of a side, or two channels, each with the record of the other."""
    effect = f', or add effects.swapped_{side}s("{first}", "{second}")' if side else ""
    words = f"like those of {first} and {second} swapped"
    return Mistake(words, f"exchange the two names{effect}")


def from_other_end(sides: Sequence[str], axis: str, ends: tuple[float, float]) -> Mistake:
    """Places of transducers that were measured from the other end of an axis, named if in space."""
    whose, total = " and ".join(f"{side}s" for side in sides), f"{sum(ends):.6g}"
    along, place = (f" along {axis}", axis) if axis else ("", "place")
    return Mistake(
        f"like those at places of the {whose} that were measured from the other end{along}",
        f"state where the {whose} sat from the other end, each {place} as {total} - {place} [m]",
    )


def _decibels(frf: Records, model: Model, frequency: Frequency) -> Values:
    """Logarithm of the amplitude by decibels, whose sign is that of the model if not known."""
    is_real = ~np.any(frf.imag, axis=-1, keepdims=True)
    sign = np.where(is_real, np.sign(frf.real), np.sign(np.log(np.abs(model))))
    return np.asarray(DECIBEL * sign * np.abs(frf))


def _without_decibels(frf: Records, model: Model, frequency: Frequency) -> Values:
    size = np.log(np.abs(frf)) / DECIBEL
    return np.log(np.where(size > 0, size, np.nan))


def _derivative(quantity: str, power: int) -> Mistake:
    """A quantity that was stated, and differentiated so many times more; integrated if negative."""
    stated = quantity_of(quantity)
    order = stated.derivative + power
    names = {known.derivative: known.frf for known in QUANTITIES}
    times = "once" if abs(power) == 1 else "twice"
    words = f"{'differentiated' if power > 0 else 'integrated'} {times} against {stated.frf}"
    remedy = (
        f'they are {names[order]}, quantity="{names[order]}"'
        if order in names
        else f"{'divide' if power > 0 else 'multiply'} them by (2j * np.pi * frequency) ** "
        f"{abs(power)}"
    )
    return Mistake(
        words,
        remedy,
        log_size=lambda frf, model, frequency: np.log(np.abs(frf)) - power * np.log(frequency),
        phase=lambda phase: phase + power * np.pi / 2,
    )


_OF_NUMBERS = (
    Mistake(
        "conjugated, as of FRFs for exp(-i omega t) with a phase that rises through resonances",
        "those for exp(i omega t) are needed: give their complex conjugates, frf.conj(), or "
        'convention = "exp(-i w t)" in a mapping',
        phase=lambda phase: -phase,
        is_of_parts=True,
        turns_time=True,
    ),
    Mistake(
        "inverted, as of force and response that were swapped",
        "motion per force is needed: give 1 / frf, or swap the two channels",
        log_size=lambda frf, model, frequency: -np.log(np.abs(frf)),
        phase=lambda phase: -phase,
        is_of_parts=True,
    ),
    Mistake(
        "like decibels that were taken for linear amplitudes",
        "give amplitudes 10 ** (decibels / 20), with the phases, or observe=observe.LogAmplitude() "
        "where there are none",
        log_size=_decibels,
        log_slope=lambda log_size: np.log(np.abs(log_size)),
        is_of_parts=True,
    ),
    Mistake(
        "like linear amplitudes that were taken for decibels",
        "give the amplitudes as they are in the file, not 10 ** (amplitude / 20)",
        log_size=_without_decibels,
        log_slope=lambda log_size: -np.log(DECIBEL) - log_size,
        is_of_parts=True,
    ),
    Mistake(
        "made with phases in degrees that were taken for radians",
        "radians are needed: amplitude * np.exp(1j * np.deg2rad(phase))",
        phase=lambda phase: phase / DEGREE,
        is_of_parts=True,
    ),
    Mistake(
        "made with phases in radians that were taken for degrees",
        "leave np.deg2rad out: amplitude * np.exp(1j * phase)",
        phase=lambda phase: phase * DEGREE,
        is_of_parts=True,
    ),
)

_OF_AXES = (
    Mistake(
        "to have lines in rad/s that were taken for Hz",
        "lines in Hz are needed: divide them by 2 pi, or state the unit rad/s in a mapping",
        axis=2 * np.pi,
    ),
    Mistake(
        "to have lines in Hz that were taken for rad/s",
        "lines in Hz are needed: multiply them by 2 pi, or state the unit Hz in a mapping",
        axis=1 / (2 * np.pi),
    ),
)


LEAST_ERROR = 0.01
"""Least relative error of an amplitude, and of a phase [rad], that a model may have."""

REVERSED = 0.05
"""Prior probability that the polarity of a pair is reversed."""

_PHASE_ERRORS = np.geomspace(LEAST_ERROR, 100 * np.pi, 40)
"""Scales of the error of a phase [rad], the last of which tells nothing of it."""

OfPairs = Float[np.ndarray, "*draw pair"]


def log_likelihoods(
    frf: Records, frequency: Frequency, model: Model, mistake: Mistake, has_phase: bool
) -> Float[np.ndarray, "draw pair"]:
    """Logarithm of the probability of each record, if a mistake was made of each response.

    Errors of log amplitude and of phase follow Laplace's distribution with scales of their own,
    over which the probability is integrated. A gain is the median of the former.
    """
    size = mistake.log_size(frf, model, frequency)
    apart = size - np.log(np.abs(model))
    apart -= np.median(apart, axis=-1, keepdims=True)
    likelihood = _of_size(frf, apart, mistake.log_slope(size))
    return likelihood + _of_phase(frf, model, mistake) if has_phase else likelihood


def like_nothing(frf: Records, frequency: Frequency, has_phase: bool) -> Float[np.ndarray, "pair"]:
    """Logarithm of the probability of each record that is a power of the frequency and chance."""
    size, line = np.log(np.abs(frf)), np.log(frequency) - np.log(frequency).mean()
    apart = size - size.mean(axis=-1, keepdims=True)
    apart -= np.outer(apart @ line / (line @ line), line)
    likelihood = _of_size(frf, apart, np.zeros_like(apart))
    of_phase = -_independent(frf / np.abs(frf)) * np.log(2 * np.pi) * _knows_phase(frf)
    return likelihood + of_phase if has_phase else likelihood


def _of_size(frf: Records, apart: np.ndarray, slope: np.ndarray) -> OfPairs:
    error = np.maximum(np.abs(apart).mean(axis=-1), LEAST_ERROR)
    likelihood = _independent(np.log(np.abs(frf))) * (slope.mean(axis=-1) - np.log(error))
    return np.where(np.isnan(likelihood), -np.inf, likelihood)


def _of_phase(frf: Records, model: Model, mistake: Mistake) -> OfPairs:
    """Logarithm of the probability of the phases, whatever polarity and error are; 0 of none."""
    count = _independent(frf / np.abs(frf))
    polarities = (1, 1 - REVERSED), (-1, REVERSED)
    likelihood = np.logaddexp(
        *(
            np.log(prior) + _of_error(frf, mistake.phase(np.angle(sign * model)), count)
            for sign, prior in polarities
        )
    )
    return np.asarray(likelihood * _knows_phase(frf))


def _of_error(frf: Records, phase: np.ndarray, count: Float[np.ndarray, "pair"]) -> OfPairs:
    """Logarithm of the probability of phases about others, over the scales of their error."""
    apart = np.abs(np.angle(frf * np.exp(-1j * phase))).mean(axis=-1)[..., None]
    size = -2 * _PHASE_ERRORS * np.expm1(-np.pi / _PHASE_ERRORS)
    of_scales = count[:, None] * (-apart / _PHASE_ERRORS - np.log(size))
    return np.asarray(logsumexp(of_scales, axis=-1) - np.log(_PHASE_ERRORS.size))


def _knows_phase(frf: Records) -> Shaped[np.ndarray, "pair"]:
    return np.any(frf.imag, axis=-1)


def _independent(values: Shaped[np.ndarray, "pair frequency"]) -> Float[np.ndarray, "pair"]:
    """Number of random values whose path is as long, over the mean distance of two of them.

    Lines of one resonance have much in common: they count as few as the record turns.
    """
    path = np.abs(np.diff(values)).sum(axis=-1)
    others = np.random.default_rng(0).permutation(values, axis=-1)
    return np.asarray(
        path / np.maximum(np.abs(values - others).mean(axis=-1), np.finfo(float).tiny)
    )
