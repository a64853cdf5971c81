"""A record beside its model: rigid-body line, units, natural frequencies, and noise as stated."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Complex, Float
from scipy.special import logsumexp

from ...modes.modes import frequencies_of
from .._noise_level import FEWEST_LINES
from ..line_choice import resonances
from ..measurement import Measurement
from .mistaken_records import LEAST_ODDS, MISTAKEN
from .mistakes import LEAST_ERROR
from .record import Fault, Pair, Record, Response, prior_responses

if TYPE_CHECKING:
    from ..experiment import Experiment


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


def has_rigid_body_line(record: Record) -> bool:
    """Tell whether the structure is free, and lines lie below its first elastic mode."""
    if record.experiment.structure.modes.rigid_body_modes == 0:
        return False
    return bool(_lines(record).sum() >= BLOCKS)


def off_rigid_body_line(record: Record) -> Iterator[Fault]:
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


FACTORS = np.array([factor for factor in KNOWN_FACTORS if abs(np.log(factor)) > np.log(4.0)])
"""Those of units: by a smaller factor modal masses, gains and missing effects change FRFs too."""

ERRORS = np.geomspace(LEAST_ERROR, 3.0, 40)
"""Scales of the error of the log gains of a model, which are unknown."""


def is_held(record: Record) -> bool:
    """Tell whether the structure is held: a free one is compared with its rigid-body line."""
    return record.experiment.structure.modes.rigid_body_modes == 0


def mistaken_units(record: Record) -> Iterator[Fault]:
    """Find the factor at which gains of all pairs are far more probable than at 1.

    The gain of a pair is the median over the lines of the FRF over that of the model at a draw from
    the priors. Its logarithm errs by Laplace's distribution of an unknown scale.
    """
    gains = _log_gains(record)
    evidence = np.array([_log_evidence(gains - np.log(factor)) for factor in FACTORS])
    log_odds = evidence - _log_evidence(gains) + np.log(MISTAKEN / FACTORS.size)
    best = int(np.argmax(log_odds))
    factor = FACTORS[best]
    if log_odds[best] > np.log(LEAST_ODDS):
        log10_odds = float(log_odds[best] / np.log(10))
        odds = f"{10**log10_odds:.0f}" if log10_odds < 3 else f"1e{int(log10_odds)}"
        yield record.fault(
            next(record.pairs),
            log10_odds,
            float(np.log10(LEAST_ODDS)),
            f"All FRFs are those of the model times {factor:.3g} "
            f"({KNOWN_FACTORS[factor]}), at odds of {odds} to 1; (m/s²)/N, (m/s)/N or "
            "m/N are needed: divide them by this factor.",
        )


def _log_gains(record: Record) -> Float[np.ndarray, "draw pair"]:
    """Logarithm of the gain of each pair at the nominal values and at draws from the priors."""
    moving = record.frequency > 0
    nominal, draws = prior_responses(record, record.frequency[moving])
    size = np.abs(np.stack([nominal, *draws])[:, record.measured])
    measured = np.abs(record.frf[record.measured][:, moving])
    with np.errstate(divide="ignore", invalid="ignore"):  # of zeros
        return np.asarray(np.median(np.log(measured) - np.log(size), axis=-1))


def _log_evidence(errors: Float[np.ndarray, "draw pair"]) -> float:
    """Logarithm of the probability of all errors of a draw, over draws and scales."""
    size = np.abs(errors).sum(axis=1)[:, None]
    of_scales = -errors.shape[1] * np.log(2 * ERRORS) - size / ERRORS
    return float(logsumexp(of_scales) - np.log(of_scales.size))


FEWEST_RESONANCES = 3
"""Resonances that are not all near natural frequencies by chance."""

LEAST_DISTANCE = 1e-6
"""Relative distance of two natural frequencies below which their shapes are any mixture."""

MARGIN = 1.05
"""Natural frequencies over the last one measured up to which modes are compared."""

NaturalFrequencies = Float[np.ndarray, "mode"]


def has_modes_alone(record: Record) -> bool:
    """Tell whether there are lines enough to see resonances, and modes that are those measured.

    Effects of the structure change its natural frequencies, soft mounts those of rigid bodies.
    """
    return record.frequency.size >= FEWEST_LINES and not record.experiment.structure.effects


def modes_elsewhere(record: Record) -> Iterator[Fault]:
    """Find natural frequencies that are all outside of the lines."""
    measured = record.frequency[resonances((record.measurement,))]
    if measured.size < FEWEST_RESONANCES:
        return
    draws = [frequencies_of(model.structure.modes) for model in record.prior_models]
    low, high = record.frequency[[0, -1]]
    first = next(record.pairs)
    if not any(np.any((modes >= low) & (modes <= high)) for modes in draws):
        greatest = max(float(modes.max()) for modes in draws)
        yield _outside(record, first, draws[0], greatest)


def _outside(record: Record, first: Pair, modes: NaturalFrequencies, greatest: float) -> Fault:
    """Fault whose value is above 1 where all natural frequencies are below the lines."""
    low, high = record.frequency[[0, -1]]
    elastic = modes[modes > 0]
    return record.fault(
        first,
        low / greatest if greatest > 0 else np.inf,
        1.0,
        f"The FRFs have resonances between {low:.4g} and {high:.4g} Hz, but no natural frequency "
        f"of the model lies there, at any draw from the priors (nominal: {elastic[0]:.3g} to "
        f"{elastic[-1]:.3g} Hz), {_cause_of_modes_elsewhere(elastic, 1000 * low, 1000 * high)}",
    )


def _cause_of_modes_elsewhere(elastic: NaturalFrequencies, low: float, high: float) -> str:
    """Which units are wrong, and what corrects them; in kHz the lines would be these."""
    if np.any((elastic >= low) & (elastic <= high)):
        return (
            "as of frequencies in kHz that are told to be in Hz: a thousand times these lines hold "
            "natural frequencies; correct their unit in the file or its mapping, or give Hz: "
            "frequency=1000 * frequency."
        )
    return (
        "as of a modulus in GPa or a length in mm; Pa, m, kg/m³ and Hz are needed: "
        "youngs_modulus=70e9."
    )


def repeated_modes(experiment: "Experiment") -> Iterator[Fault]:
    """Find two modes of the nominal structure whose natural frequencies are the same.

    A measured mode cannot be compared with one of two: the equations of its pole are singular.
    """
    modes = experiment.nominal().structure.proper_modes()
    natural = frequencies_of(modes)[modes.rigid_body_modes :]
    below = natural[natural < MARGIN * float(np.max(experiment.frequency))]
    distance = np.diff(below) / below[1:]
    for lower in np.flatnonzero(distance < LEAST_DISTANCE):
        yield Fault(
            sensor="",
            actuator="",
            value=float(distance[lower]),
            threshold=LEAST_DISTANCE,
            sentence=f"Modes {lower + 1} and {lower + 2} of the model are both at "
            f"{below[lower]:.5g} Hz, so that their shapes are any mixture and neither can be "
            "compared with a measured mode. Observe FRFs, or break the symmetry of the model: a "
            "small mass by effects.point_mass.",
        )


ALLOWED = np.sqrt(2)
"""Factor that a count of averages explains: overlapping blocks tell half as much as separate ones.

Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70.
"""

DEVIATIONS, WITH_95_PERCENT = 4.0, 1.96

_ORDER = np.array([1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0])
"""Sixth difference, which leaves little of a resonance that lines resolve, and all of the noise."""

_LINES_OF_ONE = 3.2
"""Differences that tell as much as one: 1 plus twice the squares of their correlations."""


def states_noise(record: Record) -> bool:
    """Tell whether noise is stated, at lines enough."""
    measurement = record.measurement
    by_coherence = measurement.coherence is not None and measurement.averages is not None
    is_stated = measurement.variance is not None or by_coherence
    enough = record.frequency.size >= FEWEST_LINES + _ORDER.size
    return is_stated and enough and bool(np.any(record.noise_variance > 0))


def understated_noise(record: Record) -> Iterator[Fault]:
    """Find noise that is understated, by a factor whose interval of four deviations is above 1.4.

    The sixth difference of white noise has 924 times its variance, and the square of a circular
    error has log(2) of its mean for a median. What the model leaves at draws from its priors is
    curvature. Windows make neighbouring lines alike, so that nothing is said of overstated noise.
    """
    ratio = _ratio(record, record.frf[..., record.moving])
    _, draws = prior_responses(record, record.frequency[record.moving])
    curvature = max(_square(_ratio(record, draw)) for draw in draws)
    factor = np.sqrt(max(_square(ratio) - curvature, 0.0))
    # Of the median of so many exponential distributions, and half for a root.
    deviation = np.sqrt(_LINES_OF_ONE / np.isfinite(ratio).sum()) / (2 * np.log(2))
    if factor * np.exp(-DEVIATIONS * deviation) > ALLOWED:
        low, high = factor * np.exp(WITH_95_PERCENT * deviation * np.array([-1, 1]))
        yield record.fault(
            next(record.pairs),
            float(factor),
            float(ALLOWED * np.exp(DEVIATIONS * deviation)),
            f"The noise looks understated by a factor of {factor:.2g} ({low:.2g} to {high:.2g} "
            f"with 95 % probability): neighbouring lines scatter so much more than "
            f"{_remedy(record.measurement, factor)}, or take noise.Gaussian with an unknown level.",
        )


def _ratio(record: Record, frf: Response) -> Float[np.ndarray, "sensor actuator difference"]:
    """Square of the differences over that of the stated noise, which is a share of each FRF."""
    lines = record.moving
    size = np.abs(frf) / np.where(record.frf == 0, np.nan, np.abs(record.frf))[..., lines]
    expected = _filtered(record.noise_variance[..., lines] * size**2, _ORDER**2)
    return np.abs(_filtered(frf, _ORDER)) ** 2 / np.where(expected > 0, expected, np.nan)


def _filtered(
    values: Complex[np.ndarray, "*pair frequency"] | Float[np.ndarray, "*pair frequency"],
    weights: Float[np.ndarray, "weight"],
) -> np.ndarray:
    windows = np.lib.stride_tricks.sliding_window_view(values, weights.size, axis=-1)
    return np.asarray(windows @ weights)


def _square(ratio: Float[np.ndarray, "sensor actuator difference"]) -> float:
    """Mean square by the median, which lines near a resonance change little."""
    return float(np.nanmedian(ratio) / np.log(2))


def _remedy(measurement: Measurement, factor: float) -> str:
    if measurement.variance is not None:
        return f"its variance says; give {factor**2:.2g} times the variance"
    averages = float(measurement.averages or 1)
    return (
        f"coherence and {averages:g} averages say; look at the number of averages, of which "
        f"{max(averages / factor**2, 1):.2g} would fit"
    )
