"""What a record tells without a model: copies, overload, no noise or phase, names alike."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex, Float
from scipy.special import ndtr

from ..._shared.dimensions import Spectrum
from ..._shared.errors import InputError
from ...positions.channel import look_alike
from .._experiment_checks import at_levels
from .._noise_level import FEWEST_LINES
from ..measurement import Measurement
from ..modal_parameters import ModalParameters
from ..observe import LogAmplitude
from .record import Fault, Pair, Record

if TYPE_CHECKING:
    from ..experiment import Experiment


ROUNDING = 1e-9
"""Distance from 1 within which a coherence is 1."""

SHARE = 0.95
"""Share of lines from which on a coherence is 1 everywhere."""


def has_coherence(record: Record) -> bool:
    """Tell whether there is a coherence."""
    coherence = record.measurement.coherence
    return coherence is not None and bool(np.isfinite(coherence).any())


def full_coherence(record: Record) -> Iterator[Fault]:
    """Find a coherence of 1: the estimate of one average is 1 whatever the noise is.

    Bendat and Piersol, Random Data, ch. 9.
    """
    coherence = np.asarray(record.measurement.coherence)
    share = np.mean(coherence >= 1 - ROUNDING, axis=-1)
    pairs = [Pair(*map(int, numbers)) for numbers in np.argwhere(share > SHARE)]
    if pairs:
        count = len(list(record.pairs))
        where = "all pairs" if len(pairs) == count else f"{len(pairs)} of {count} pairs"
        yield record.fault(
            pairs[0],
            float(share[pairs[0]]),
            SHARE,
            f"The coherence of {where} (first {record.label(pairs[0])}) is 1 at "
            f"{100 * float(share[pairs[0]]):.0f} % of the lines, which one average gives whatever "
            "the noise is: it says nothing of the noise, so leave it out, coherence=None, and "
            "take noise.Gaussian with an unknown level.",
        )


def observes_phase(record: Record) -> bool:
    """Tell whether phases are observed, at lines enough."""
    observed = not isinstance(record.experiment.observe, LogAmplitude)
    return observed and record.frequency.size >= FEWEST_LINES


def no_phase(record: Record) -> Iterator[Fault]:
    """Find FRFs without a phase."""
    real = [pair for pair in record.pairs if not np.any(np.nan_to_num(record.frf[pair]).imag)]
    if real:
        yield record.fault(
            real[0],
            0.0,
            0.0,
            f"{record.whose(real)} have no imaginary part at any line, as of amplitudes "
            "or real parts that were taken for complex FRFs; the phase is needed, since a "
            "damped structure turns it: give real and imaginary parts, or amplitudes and phases, "
            "or observe=observe.LogAmplitude().",
        )


def has_names_alike(record: Record) -> bool:
    """Tell whether two names of one side look alike; else there is nothing to tell."""
    return any(names_alike(record))


def names_alike(record: Record) -> Iterator[Fault]:
    """Find names of one side that differ in case or in the form of letters alone."""
    for side, channels in enumerate((record.measurement.sensors, record.measurement.actuators)):
        names = [channel.name for channel in channels]
        for number, name in enumerate(names):
            hint = look_alike(name, names[:number]) if name not in names[:number] else ""
            if hint:
                pair = Pair(0, number) if side else Pair(number, 0)
                sentence = (
                    f"Two names are easily confused:{hint} Where they are one transducer, leave "
                    "one of them out; else give them other names."
                )
                yield record.fault(pair, 1.0, 0.0, sentence)


SIX_DIGITS = 1e-6
"""Relative distance of numbers that are one: universal files carry six digits."""

FLAT_SHARE = 0.5
"""Share of lines with one value from which on a record is flat."""

CLIPPED_LINES = 5
"""Neighbouring lines at the greatest value from which on a record is clipped."""


def has_lines(record: Record) -> bool:
    """Tell whether there are lines enough."""
    return record.frequency.size >= FEWEST_LINES


def overloaded(record: Record) -> Iterator[Fault]:
    """Find records that stay at one value: at their greatest, or at most lines.

    A resonance touches its greatest value at one line; a range that is exceeded stays there.
    """
    for pair in record.pairs:
        frf = record.frf[pair]
        parts = {"amplitude": np.abs(frf), "real part": frf.real, "imaginary part": frf.imag}
        for part, values in parts.items():
            stays = _at_greatest(values)
            flat, run = float(stays.mean()), _longest_run(stays)
            if flat <= FLAT_SHARE and run < CLIPPED_LINES:
                continue
            if not np.abs(values).max() > 0 and part != "amplitude":
                continue  # a part that is zero throughout is no range that was exceeded
            first = record.frequency[int(np.argmax(stays))]
            what = (
                f"is flat: it has one value at {100 * flat:.0f} % of its lines"
                if flat > FLAT_SHARE
                else f"is clipped: it stays at its greatest value for {run} lines from "
                f"{first:.4g} Hz on"
            )
            yield record.fault(
                pair,
                max(flat, run / CLIPPED_LINES),
                FLAT_SHARE if flat > FLAT_SHARE else 1.0,
                f"The {part} of {record.label(pair)} {what}, as of a channel that was overloaded "
                "or not connected; measure it again with a wider range, or leave it out.",
            )
            break


def _at_greatest(values: Spectrum) -> np.ndarray:
    greatest = np.abs(values).max()
    return np.asarray(np.abs(values) >= greatest * (1 - SIX_DIGITS))


def _longest_run(stays: np.ndarray) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], stays, [False]])))
    return int(np.max(edges[1::2] - edges[::2], initial=0))


PARALLEL = 1e-10
"""Loss of correlation below which two records are compared; of two copies it is 1e-12."""


def has_two_pairs(record: Record) -> bool:
    """Tell whether there are two pairs to compare."""
    return record.frequency.size >= FEWEST_LINES and int(record.measured.sum()) > 1


def repeated(record: Record) -> Iterator[Fault]:
    """Find two records that are one, up to its sign.

    Two measurements of one thing differ by their noise; only a copy agrees to six digits.
    """
    pairs = list(record.pairs)
    for first, second in _alike(np.stack([record.frf[pair] for pair in pairs])):
        distance = _distance(record.frf[pairs[first]], record.frf[pairs[second]])
        if distance < SIX_DIGITS:
            yield record.fault(
                pairs[second],
                distance,
                SIX_DIGITS,
                f"{record.label(pairs[first])} and {record.label(pairs[second])} hold the same "
                "record to six digits, and two measurements would differ by their noise: it was "
                "exported twice or cabled wrongly, so leave one of them out.",
            )


def _alike(records: Complex[np.ndarray, "record frequency"]) -> list[tuple[int, int]]:
    """Numbers of two records, the second with the first that it is parallel to."""
    size = np.linalg.norm(records, axis=1, keepdims=True)
    unit = records / np.where(size > 0, size, 1.0)
    parallel = np.triu(np.abs((unit @ unit.conj().T).real) > 1 - PARALLEL, 1)
    return [(int(np.argmax(column)), n) for n, column in enumerate(parallel.T) if column.any()]


def _distance(first: np.ndarray, second: np.ndarray) -> float:
    size = np.linalg.norm(first)
    apart = min(np.linalg.norm(first - second), np.linalg.norm(first + second))
    return float(apart / size) if size > 0 else 0.0


LEVEL = 0.05
"""Probability with which noise alone is taken for a signal."""

FEWEST_VALUES = 64
"""Fewest values that are looked at: few lines of narrow resonances may scatter as noise does."""

LEAST = float(np.sqrt(np.finfo(float).tiny))
"""Least FRF whose square is a number of full precision."""

SPREAD, KURTOSIS = np.pi**2 / 24, 5.4
"""Variance of the logarithm of the amplitude of complex Gaussian noise, and its kurtosis."""

Scores = Float[np.ndarray, "test"]


def check_signal(
    experiment: "Experiment", measurement: Measurement | ModalParameters | Sequence[Measurement]
) -> None:
    """Refuse FRFs that noise alone explains, whatever its level."""
    if experiment.observe.is_modal or experiment.noise is None:
        return
    channels = experiment.sensor_channels, experiment.actuator_channels
    runs = [run.channels(*channels) for run in at_levels(measurement, experiment.force_levels)]
    frfs = [run.frf[tuple(pair)] for run in runs for pair in np.argwhere(run.measured)]
    size = max((float(np.abs(frf).max()) for frf in frfs), default=0.0)
    if size < LEAST:
        raise InputError(
            f"There is no signal: the greatest FRF is {size:g}; responses of a structure are "
            "needed, since a search explains what was measured. Look at the units and at the "
            "cables, and measure again."
        )
    if sum(map(len, frfs)) >= FEWEST_VALUES and not is_signal(frfs):
        raise InputError(
            "There is no signal: FRFs at neighbouring lines have no more in common than noise has, "
            "and their amplitudes scatter as those of noise do; responses of a structure are "
            "needed, since a search would explain noise. Look at sensors and cables, measure with "
            "more force, or average more."
        )


def is_signal(frfs: Sequence[np.ndarray]) -> bool:
    """Whether FRFs of a pair each are no noise, which is independent from line to line."""
    scores = np.sum([_scores(frf) for frf in frfs], axis=0) / np.sqrt(len(frfs))
    p_values = 2 * ndtr(-np.abs(scores))
    return bool(p_values.min() < LEVEL / p_values.size)


def _scores(frf: np.ndarray) -> Scores:
    """Standard scores of an FRF: likeness of neighbours, of their sizes, and scatter of these."""
    if not np.any(frf):
        return np.zeros(3)
    size = np.log(np.maximum(np.abs(frf), LEAST))
    scatter = (np.var(size) / SPREAD - 1) * np.sqrt(len(frf) / (KURTOSIS - 1))
    return np.array([_likeness(frf), _likeness(size), scatter])


def _likeness(values: np.ndarray) -> float:
    """Correlation of neighbours over its deviation (von Neumann, 1941)."""
    apart = values - values.mean()
    squares = float(np.sum(np.abs(apart) ** 2))
    if squares <= len(values) * (LEAST + np.finfo(float).eps * np.abs(values.mean())) ** 2:
        return 0.0
    alike = float(np.sum(apart[1:] * apart[:-1].conj()).real) / squares
    independent = 2 if np.iscomplexobj(values) and np.any(apart.imag) else 1
    return (alike + 1 / len(values)) * np.sqrt(independent * len(values))
