"""identification: natural frequencies, damping ratios and shapes of FRFs, without a model."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from ..._shared.arguments import arguments_checked, shown
from ..._shared.errors import InputError, warn
from ..._shared.garbage import long_computation
from .._modal_checks import MOST_IMAGINARY
from ..line_choice import peaks_at_ends
from ..measurement import Measurement
from ..modal_parameters import DAMPING, FREQUENCY, SHAPE, ModalParameters
from .band import ROUNDING, Band, PoleFit
from .mode import IdentifiedMode, PeakGroup, best_fit, groups_of, identified_mode, poles_of

GROWS = 3.0
"""Standard deviations by which a pole grows that is none of a passive structure."""

LEVEL = 0.01
"""Probability with which noise as stated scatters as much as is told."""

NO_POLE = "no pole is near it"

Side = Literal["sensors", "actuators"]
"""Channels at which shapes are identified."""


class IdentificationWarning(UserWarning):
    """A peak of the FRFs that is no mode, or lines that the modes do not explain."""


class Identified(NamedTuple):
    """Modal parameters, and what is to be said of them."""

    modes: ModalParameters
    words: tuple[str, ...]


@arguments_checked
@long_computation()
def identify(
    measurement: Measurement, *, shapes_at: Side = "sensors", number: object = None
) -> ModalParameters:
    """Identify natural frequencies, damping ratios and shapes of FRFs, with their covariances.

    Peaks of the FRFs of all pairs that stand out of the noise are fitted in groups of close ones:
    common poles, residues of each pair, and a cubic for all that resonates elsewhere. The start is
    a common denominator by linear least squares, the result that of greatest likelihood, with the
    noise of the measurement (its variance, else coherence and averages, else the scatter of its
    lines). A pole more is taken as long as the Bayes information criterion asks for it and it
    splits no mode in two. Shape and participation are the product that is nearest to the residues.

    Errors are those of the Gauss-Newton matrix, larger where the lines scatter more about the fit.
    The scale of a shape means nothing; it is given an error like those of its other directions.
    Modes at the ends of the lines, and peaks that are none, are left out with a warning.

    Parameters
    ----------
    measurement
        FRFs of displacement, velocity or acceleration, of one or several actuators.
    shapes_at
        Whether shapes are those at the sensors, or at the actuators: where a hammer went from place
        to place.
    number
        As of `ModalParameters`.

    Returns
    -------
    ModalParameters
        The modes, as `observe.ModalData` takes them.

    Raises
    ------
    InputError
        If no peak stands out of the noise, or none is a mode.

    Examples
    --------
    >>> line = np.arange(50.0, 150.0, 0.5)
    >>> frf = 1 / (100.0**2 - line**2 + 0.02j * 100.0 * line)
    >>> one = {"sensors": ["s1"], "actuators": ["a1"], "quantity": "receptance"}
    >>> modes = bp.identify(bp.Measurement.from_arrays(frf, line, **one))
    >>> modes.natural_frequency.round(3), modes.damping_ratio.round(5)
    (array([100.]), array([0.01]))
    """
    if shapes_at not in get_args(Side):
        raise InputError(
            f"shapes_at={shown(shapes_at)} was given; the side is needed on which a shape has its "
            "channels, since residues are products of both: shapes_at='sensors' or 'actuators'."
        )
    modes, words = identified(measurement, shapes_at, number)
    for sentence in words:
        warn(sentence, IdentificationWarning)
    return modes


def identified(measurement: Measurement, shapes_at: Side, number: object = None) -> Identified:
    """Return the modes of a measurement, and sentences on what is left out or not explained."""
    moving = measurement.without(0, 0) if measurement.frequency[0] == 0 else measurement
    if shapes_at == "actuators":
        moving = _turned(moving)
    _check_channels(moving)
    variance = _variance(moving)
    groups = [_identified(moving, variance, group) for group in groups_of(moving)]
    modes = sorted((mode for group in groups for mode in group.modes), key=_frequency)
    words = [*_cut_off(moving), *(sentence for group in groups for sentence in group.words)]
    if not modes:
        raise _no_mode(moving.frequency, words)
    words += [*_complex(modes), *_not_explained(groups)]
    seen = np.any(moving.measured, axis=1)
    values = np.stack([_real_values(mode, seen) for mode in modes], axis=1)
    known = ModalParameters(
        values[FREQUENCY],
        damping_ratio=values[DAMPING],
        shape=values[SHAPE:],
        sensors=moving.sensors,
        covariance=np.stack([mode.covariance for mode in modes]),
        number=number,
    )
    return Identified(known, tuple(words))


class _GroupFit(NamedTuple):
    """Modes of a group of peaks, and why others are none."""

    group: PeakGroup
    fit: PoleFit
    modes: list[IdentifiedMode]
    words: list[str]


def _identified(
    measurement: Measurement, variance: np.ndarray | None, group: PeakGroup
) -> _GroupFit:
    band = _band(measurement, variance, group)
    fit = best_fit(band, group)
    poles = poles_of(band, fit, group)
    modes = [identified_mode(band, fit, pole, measurement.measured) for pole in poles]
    faults = [_fault(mode) for mode in modes]
    alone = group.without(np.array([_frequency(mode) for mode in modes]))
    named = [*zip(map(_frequency, modes), faults, strict=True), *((f, NO_POLE) for f in alone)]
    return _GroupFit(
        group,
        fit,
        [mode for mode, fault in zip(modes, faults, strict=True) if not fault],
        [f"The peak at {f:.4g} Hz is left out: {fault}." for f, fault in named if fault],
    )


def _band(measurement: Measurement, variance: np.ndarray | None, group: PeakGroup) -> Band:
    """Lines of a group; where nothing tells the noise, of each pair a share of its size."""
    frf = measurement.frf[measurement.measured][:, group.inside]
    size = np.mean(np.abs(frf) ** 2, axis=1, keepdims=True)
    if variance is None:
        noise = np.broadcast_to(size, frf.shape)
    else:
        noise = np.maximum(variance[measurement.measured][:, group.inside], ROUNDING * size)
    weight = 1 / np.sqrt(noise)
    return Band(measurement.frequency[group.inside], frf * weight, weight, variance is not None)


def _cut_off(measurement: Measurement) -> Iterator[str]:
    for frequency in measurement.frequency[peaks_at_ends(measurement)]:
        yield (
            f"The peak at {frequency:.4g} Hz is left out: it is cut off by the end of the lines, "
            f"from {measurement.frequency[0]:g} to {measurement.frequency[-1]:g} Hz, and its "
            "damping is not told; measure a wider band."
        )


def _fault(mode: IdentifiedMode) -> str:
    """Why a pole is no mode; empty where it is one."""
    ratio = mode.values[DAMPING]
    if ratio < -GROWS * np.sqrt(mode.covariance[DAMPING, DAMPING]):
        return f"its damping ratio would be {ratio:.2g}, and no structure gains energy"
    return ""


def _frequency(mode: IdentifiedMode) -> float:
    return float(mode.values[FREQUENCY])


def _check_channels(measurement: Measurement) -> None:
    """Refuse pairs that read nothing, of which no share of any mode is known."""
    for row, column in np.argwhere(measurement.measured):
        if not np.any(measurement.frf[row, column]):
            sensor, actuator = measurement.sensors[row].label, measurement.actuators[column].label
            raise InputError(
                f"The FRF of {sensor} by {actuator} is zero at all lines; what was measured is "
                "needed, since a channel that reads nothing has no share in a mode. Leave it out: "
                "measurement.channels([...], [...])."
            )


def _turned(measurement: Measurement) -> Measurement:
    """The measurement with its actuators as sensors, by reciprocity."""
    names = ("frf", "coherence", "variance", "coherent_variance", "line_scatter")
    arrays = {name: getattr(measurement, name) for name in names}
    turned: dict[str, Any] = {
        name: None if a is None else a.swapaxes(0, 1) for name, a in arrays.items()
    }
    return replace(
        measurement, sensors=measurement.actuators, actuators=measurement.sensors, **turned
    )


def _variance(measurement: Measurement) -> np.ndarray | None:
    """Variance of the noise; None where nothing tells it."""
    if measurement.variance is not None:
        return measurement.stated_variance()
    if measurement.coherence is not None and measurement.averages is not None:
        return measurement.noise_variance()
    try:
        return measurement.scatter_variance()
    except InputError:  # too few lines, or computed ones
        return None


def _real_values(mode: IdentifiedMode, seen: np.ndarray) -> np.ndarray:
    """Values of a mode, without a shape that is complex, or where no channel was measured."""
    values = mode.values.copy()
    values[SHAPE:][~seen | (mode.imaginary > MOST_IMAGINARY)] = np.nan
    return values


def _complex(modes: list[IdentifiedMode]) -> Iterator[str]:
    for mode in modes:
        if mode.imaginary > MOST_IMAGINARY:
            yield (
                f"The shape of the mode at {_frequency(mode):.4g} Hz is left out: it remains to "
                f"{mode.imaginary:.0%} imaginary after the best turn, and shapes are compared by "
                "their real parts. Its frequency and damping count."
            )


def _not_explained(groups: list[_GroupFit]) -> Iterator[str]:
    """Where the lines scatter more about the fit than their noise."""
    wide = [
        (group.group.peaks[0], np.sqrt(group.fit.excess))
        for group in groups
        if group.fit.least_excess == 1 and group.fit.probability < LEVEL
    ]
    if wide:
        peaks, factors = zip(*wide, strict=True)
        yield (
            f"About {', '.join(f'{peak:.4g}' for peak in peaks)} Hz the lines scatter up to "
            f"{max(factors):.2g} times as much about the modes as their noise; errors are larger "
            "by that. Look for resonances that drift, or for a noise that is stated too small."
        )


def _no_mode(lines: np.ndarray, words: list[str]) -> InputError:
    why = " ".join(words) or "No peak of the FRFs stands out of their noise."
    return InputError(
        f"identify() was asked of {lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz. "
        f"{why} One mode at least is needed, to return modal parameters. Measure a band with "
        "resonances, and give all its lines: bp.identify(measurement)."
    )
