"""Where a fitted hypothesis fails: its worst sensor and band, and single lines that stand out."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import fdtrc

from ...effects.mains_hum import MAINS
from ...experiment.data_checks.mains import at_multiples, can_have_hum
from ...inference.chi2 import LEVEL
from ..check._residuals import bands_of
from ._hypotheses import Hypothesis

BANDS = 8
"""Frequency bands, of as many lines each."""

BESIDE = (-2, -1, 1, 2)
"""Lines with which each is compared."""

MOST_NAMED = 6
"""Lines of a sensor that are named."""

BySensor = Float[np.ndarray, "sensor frequency"]


def where_it_fails(hypothesis: Hypothesis) -> str:
    """Say at which sensor, in which band and at which single lines residuals are largest.

    Empty where modes are observed, which are few and told one by one.
    """
    experiment = hypothesis.problem.experiment
    if experiment.observe.is_modal:
        return ""
    frequency = np.asarray(experiment.frequency)
    order = np.argsort(frequency)
    sensors = [channel.label for channel in experiment.sensor_channels]
    squares, count = (array[:, order] for array in _by_sensor(hypothesis, len(sensors)))
    band, names = bands_of(frequency[order], BANDS)
    where = _worst(squares, count, sensors, band, names["band"])
    lines = [*_lines_in_words(squares, count, frequency[order], sensors)]
    return " ".join(
        [
            *([f"It fails most {', '.join(where)}."] if where else []),
            *([f"Single lines stand out: {'; '.join(lines)}."] if lines else []),
        ]
    )


def _worst(
    squares: BySensor,
    count: BySensor,
    sensors: Sequence[str],
    band: Int[np.ndarray, "frequency"],
    names: Sequence[object] | np.ndarray,
) -> list[str]:
    """The worst sensor, and its worst band, where there are several."""
    sensor = int(np.argmax(_excess(squares.sum(axis=1), count.sum(axis=1))))
    sums = (np.bincount(band, array[sensor]) for array in (squares, count))
    worst_band = names[int(np.argmax(_excess(*sums)))]
    return [
        *([f"at sensor {sensors[sensor]}"] if len(sensors) > 1 else []),
        *([f"from {worst_band}"] if len(names) > 1 else []),
    ]


def _by_sensor(hypothesis: Hypothesis, sensors: int) -> tuple[BySensor, BySensor]:
    """Squared residuals and numbers of data of each sensor and line of the experiment.

    With an earlier state, those of the later one, which come first.
    """
    present = np.asarray(hypothesis.problem.data.measured)
    shape = (sensors, -1, present.shape[-1])
    squares = hypothesis.residual[: present.size].reshape(shape) ** 2
    known = present.reshape(shape)
    return np.sum(squares * known, axis=1), np.sum(known, axis=1).astype(float)


def _excess(squares: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Chi2 less its mean, over its standard deviation; least where nothing was measured."""
    excess = (squares - count) / np.sqrt(2 * np.maximum(count, 1.0))
    return np.where(count > 0, excess, -np.inf)


def _lines_in_words(
    squares: BySensor, count: BySensor, frequency: np.ndarray, sensors: list[str]
) -> Iterator[str]:
    """For each sensor the lines that stand out, and whether these are those of the mains."""
    p_values = _p_values(squares, count)
    limit = LEVEL / max(1, int(np.isfinite(p_values).sum()))
    for sensor, p_value in zip(sensors, p_values, strict=True):
        out = np.isfinite(p_value) & (np.nan_to_num(p_value, nan=1.0) < limit)
        if out.any():
            mains = _mains(p_value, limit, frequency)
            chosen = out if mains is None else mains
            yield f"{sensor} at {_named(frequency[chosen])} Hz{'' if mains is None else ': mains'}"


def _p_values(squares: BySensor, count: BySensor) -> BySensor:
    """Probability that a line is as much larger than those beside it; NaN where it has too few.

    A misfit of the structure spreads over neighbouring lines, which then are as large.
    """
    inner = slice(2, -2)
    p_values = np.full(squares.shape, np.nan)
    around, number = (
        sum(np.roll(array, shift, axis=1) for shift in BESIDE) for array in (squares, count)
    )
    complete = (count > 0) & (number == len(BESIDE) * count) & (around > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = squares * number / (count * around)
        tail = fdtrc(count, number, ratio)
    p_values[:, inner] = np.where(complete, tail, np.nan)[:, inner]
    return p_values


def _mains(
    p_value: Float[np.ndarray, "frequency"], limit: float, frequency: np.ndarray
) -> Bool[np.ndarray, "frequency"] | None:
    """Lines that stand out at multiples of 50 or 60 Hz, unless chance explains as many."""
    if not can_have_hum(frequency):
        return None
    size = -np.log(np.maximum(p_value, np.finfo(float).tiny))
    hums = (at_multiples(size, -np.log(limit), frequency, mains) for mains in MAINS)
    found = [hum for hum in hums if hum is not None]
    return min(found, key=lambda hum: hum.coincidence).lines if found else None


def _named(lines: np.ndarray) -> str:
    further = f" and {lines.size - MOST_NAMED} more" if lines.size > MOST_NAMED else ""
    return ", ".join(f"{line:.4g}" for line in lines[:MOST_NAMED]) + further
