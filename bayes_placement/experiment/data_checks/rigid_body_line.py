"""Rigid-body line: below its first elastic mode a free structure answers as a rigid body."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Complex

from .record import Fault, Record, prior_responses

BELOW = 0.7
"""Highest line that is used, over the first elastic natural frequency."""

DEVIATION = 0.3
"""Deviation from the line that missing masses and gains explain [1]."""

BLOCKS = 3
"""Stretches of the line that are judged by their medians."""

DRAW_DEVIATIONS, NOISE_DEVIATIONS = 3.0, 4.0

KNOWN_FACTORS = {
    9.80665: "as of m/s² in the place of the unit g",
    1 / 9.80665: "as of the unit g in the place of m/s²",
    1000.0: "as of millimetres in the place of metres",
    1e-3: "as of metres in the place of millimetres",
    2 * np.pi: "2 pi, as of rad/s in the place of Hz",
    1 / (2 * np.pi): "1/(2 pi), as of Hz in the place of rad/s",
    np.sqrt(2): "the root of 2, as of peak values in the place of effective ones",
    1 / np.sqrt(2): "1 over the root of 2, as of effective values in the place of peak ones",
    4.4482216: "as of newtons in the place of pounds",
    1 / 4.4482216: "as of pounds in the place of newtons",
}
"""Wrong factors that happen, and what they mean."""

_CONSTANT, _FACTOR_PRECISION = 0.15, 0.03

Ratio = Complex[np.ndarray, "block"]


def can_check(record: Record) -> bool:
    """Tell whether the structure is free, and lines lie below its first elastic mode."""
    if record.experiment.structure.modes.rigid_body_modes == 0:
        return False
    return bool(_lines(record).sum() >= BLOCKS)


def check(record: Record) -> Iterator[Fault]:
    """Find pairs that leave the rigid-body line.

    The measured FRF over that of the nominal model is 1, as a median over each of three stretches
    below 0.7 times the first elastic natural frequency. It may deviate by 30 %, since a missing
    mass lowers the line as well, by three deviations of the model at draws from the priors, and by
    four of the noise.
    """
    lines = _lines(record)
    nominal, draws = prior_responses(record, record.frequency[lines])
    blocks = np.array_split(np.arange(int(lines.sum())), BLOCKS)
    for pair in record.pairs:
        ratio = _medians(record.frf[pair][lines] / nominal[pair], blocks)
        spread = np.std([_medians(draw[pair] / nominal[pair], blocks) for draw in draws], axis=0)
        noise = np.sqrt(record.noise_variance[pair][lines]) / np.abs(nominal[pair])
        allowed = DEVIATION + DRAW_DEVIATIONS * spread
        allowed += NOISE_DEVIATIONS * _median_deviation(noise, blocks)
        worst = int(np.argmax(np.abs(ratio - 1) / allowed))
        if np.abs(ratio - 1)[worst] > allowed[worst]:
            low, high = record.frequency[lines][blocks[worst][[0, -1]]]
            yield record.fault(
                pair,
                float(np.abs(ratio - 1)[worst]),
                float(allowed[worst]),
                f"{record.label(pair)} does not follow the rigid-body line of the free structure: "
                f"from {low:.4g} to {high:.4g} Hz, below the first elastic mode, it deviates by "
                f"{100 * np.abs(ratio - 1)[worst]:.0f} % ({_factor_words(ratio)}), where at most "
                f"{100 * allowed[worst]:.0f} % are expected: look at unit, polarity and "
                "recorded place of these channels, and at the mass of the model.",
            )


def _lines(record: Record) -> Bool[np.ndarray, "frequency"]:
    modes = record.experiment.nominal().structure.modes
    natural = np.asarray(modes.solved().natural_frequency)
    elastic = natural[modes.rigid_body_modes :]
    limit = BELOW * float(elastic[0]) if elastic.size else np.inf
    return np.asarray((record.frequency > 0) & (record.frequency < limit))


def _medians(ratio: Complex[np.ndarray, "line"], blocks: list[np.ndarray]) -> Ratio:
    return np.array(
        [np.median(ratio[block].real) + 1j * np.median(ratio[block].imag) for block in blocks]
    )


def _median_deviation(noise: np.ndarray, blocks: list[np.ndarray]) -> np.ndarray:
    """Standard deviation of the median of each block: sqrt(pi/2) times that of its mean."""
    return np.array([np.sqrt(np.pi / 2 * np.mean(noise[b] ** 2) / b.size) for b in blocks])


def _factor_words(ratio: Ratio) -> str:
    """Write how the measurement differs from the line: by one factor, or otherwise."""
    factor = complex(np.median(ratio.real), np.median(ratio.imag))
    constant = np.all(np.abs(ratio - factor) < _CONSTANT * np.abs(factor))
    if not constant or abs(factor.imag) > _CONSTANT * abs(factor):
        return "no common factor"
    known = [word for size, word in KNOWN_FACTORS.items() if _near(abs(factor), size)]
    reason = f", {known[0]}" if known else ""
    polarity = ", of reversed polarity" if factor.real < 0 else ""
    return f"a factor of {factor.real:.3g}{polarity}{reason}"


def _near(size: float, factor: float) -> bool:
    return bool(abs(size / factor - 1) < _FACTOR_PRECISION)
