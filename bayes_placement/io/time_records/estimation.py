"""FRFs from time records of one force and the responses to it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np
from jaxtyping import Complex, Int

from ..._shared.arguments import check_annotated, check_count, check_kind, shown
from ..._shared.errors import InputError, warn
from ...experiment import _noise_level
from ...experiment._measurement_checks import band as check_band
from ...experiment.line_choice import half_power_bandwidth, mode_indicator, resonances
from ...experiment.measurement import Measurement
from ...positions.channel import Channel, Channels
from . import estimate as estimators
from .estimate import Estimate, EstimateWarning, Excitation, Spectra
from .recording import Recording, joined
from .records import Samples, records

CORRELATED = 1.5
"""Correlated lines above which a likelihood of independent lines is said to be too narrow."""

ALIKE = 2.0
"""Times the correlation that the windows give, above which that of the repeats is stated."""

FEW_REPEATS = 2.5
"""Repeats below which the variance rests on the likeness of neighbouring lines."""


def frf(
    force: object,
    response: object,
    rate: float | int,
    *,
    excitation: Excitation,
    quantity: str,
    actuator: str | Channel,
    sensors: Channels | None = None,
    band: tuple[float | int, float | int] | None = None,
    estimator: str = "H1",
    every: int | None = None,
    neighbours: int | None = None,
    ranges: Mapping[str, float | int] | None = None,
) -> Estimate:
    """Estimate FRFs from time records of one force and the responses to it.

    The variance of each line is that of the jackknife over the repeats, pooled over neighbouring
    lines so far that it is known to 10 %: it contains all that differs from repeat to repeat.
    What repeats have in common it does not contain, such as the bias of H1 by noise of the force,
    Smm / Sff of |H|, and an error of a sensitivity.

    Parameters
    ----------
    force
        Force [N]: the samples of one record, or those of several, (record, sample) or a sequence.
    response
        Motion in SI in the form of the force, for each sensor: a mapping from sensor labels, or a
        sequence in the order of `sensors`. That of one sensor may stand alone.
    rate
        Sampling rate [Hz], the same of all channels, which are sampled together.
    excitation
        `Impacts(...)` or `Continuous(...)`.
    quantity
        What the sensors record: `displacement`, `velocity` or `acceleration`.
    actuator
        Label of the force: that of an actuator of the experiment.
    sensors
        Labels of the responses, where they are no mapping.
    band
        First and last line [Hz], both included; None for all below half of the rate.
    estimator
        `H1`, which noise of the response does not bias; `H2`, which noise of the force does not
        bias; `Hv`, their geometric mean.
    every
        Which lines are kept: every second one with 2. None for as many as have independent errors,
        since a likelihood counts each line once.
    neighbours
        Lines over which the variance is pooled; 1 for each line by itself. None for as many as
        needed.
    ranges
        Greatest values that channels can record, by label: whatever reaches them is overloaded.

    Returns
    -------
    Estimate
        The `measurement`, `effects` to add, and sentences on what was left out and why.

    Raises
    ------
    InputError
        If an argument is wrong, a channel is overloaded throughout, or fewer than two repeats are
        left.

    Warns
    -----
    EstimateWarning
        For each sentence of `Estimate.warnings`.

    Examples
    --------
    >>> force = np.random.default_rng(0).standard_normal(4096)
    >>> labels = {"quantity": "acceleration", "actuator": "a1", "sensors": ["s1"]}
    >>> by_shaker = bp.time_records.Continuous(segment=0.5)
    >>> estimate = bp.time_records.frf(force, [2 * force], 512.0, excitation=by_shaker, **labels)
    >>> complex(estimate.measurement.frf[0, 0, 0]).real
    1.9999999999999996
    """
    _check_options(estimator, excitation, every=every, neighbours=neighbours)
    recorded = records(force, response, rate, sensors=sensors, actuator=actuator, ranges=ranges)
    spectra = _in_band(excitation.spectra(recorded), band)
    _check_spectra(spectra)
    step = every or max(1, round(spectra.correlated_lines))
    thinned = _thinned(spectra, step)
    rows = [_of_sensor(thinned, motion, estimator, neighbours) for motion in thinned.response]
    frfs, coherence, scatter, variance = np.array(rows).swapaxes(0, 1)[:, :, None]
    measurement = Measurement.from_arrays(
        frfs,
        thinned.frequency,
        sensors=recorded.sensors,
        actuators=[recorded.actuator],
        quantity=quantity,
        coherence=coherence.real,
        averages=int(thinned.averages),
        variance=variance.real,
    )
    doubts = _warnings(thinned), _alike(thinned, estimator, step)
    warned = chain(*doubts, _resolution(thinned, measurement, recorded.rate))
    estimate = Estimate(
        measurement=measurement,
        estimator=estimator,
        repeats=len(thinned.force),
        scatter=scatter.real,
        done=thinned.done,
        left_out=thinned.left_out,
        warnings=(*thinned.warnings, *warned),
        time_constant=thinned.time_constant,
    )
    for sentence in estimate.warnings:
        warn(sentence, EstimateWarning)
    return estimate


def frf_of(
    recordings: Recording | Sequence[Recording],
    actuator: str | Channel,
    *,
    excitation: Excitation,
    **options: Any,
) -> Estimate:
    """Estimate FRFs from recordings whose channels bear the labels of sensors and actuators.

    Parameters
    ----------
    recordings
        One recording, or several with the same channels, such as one for each hit.
    actuator
        Label of the force; all other channels are responses.
    excitation
        `Impacts(...)` or `Continuous(...)`.
    **options
        Further arguments of `frf`.

    Returns
    -------
    Estimate
        As of `frf`.

    Raises
    ------
    InputError
        If the channels differ, the force is no force, or the responses are of several quantities.

    Examples
    --------
    >>> force = np.random.default_rng(0).standard_normal(4096)
    >>> quantity = {"a1": "force", "s1": "acceleration"}
    >>> recording = bp.time_records.Recording(512.0, {"a1": force, "s1": 2 * force}, quantity)
    >>> by_shaker = bp.time_records.Continuous(segment=0.5)
    >>> bp.time_records.frf_of(recording, "a1", excitation=by_shaker).repeats
    31
    """
    label = Channel.parse(actuator).label
    together = joined(recordings, label)
    return frf(
        together.force,
        together.response,
        together.rate,
        excitation=excitation,
        quantity=together.quantity,
        actuator=label,
        **options,
    )


def _of_sensor(
    spectra: Spectra,
    motion: Complex[np.ndarray, "repeat frequency"],
    estimator: str,
    neighbours: int | None,
) -> Complex[np.ndarray, "value frequency"]:
    """FRF, coherence, variance by the repeats of each line, and pooled variance of a sensor."""
    function = estimators.ESTIMATORS[estimator]
    repeats = estimators.products(spectra.force, motion)
    total = estimators.summed(repeats)
    response = function(total)
    scatter = estimators.scatter(function, repeats, spectra.averages)
    count = neighbours or _noise_level.neighbours(spectra.averages, spectra.correlated_lines)
    variance = _noise_level.pooled(scatter, total.force, np.abs(response), spectra.averages, count)
    return np.array([response, estimators.coherence(total), scatter, variance])


def _in_band(spectra: Spectra, band: tuple[float | int, float | int] | None) -> Spectra:
    if band is None:
        return spectra
    check_annotated("band", band, tuple[float, float])
    check_band(*band)
    in_band = np.flatnonzero((spectra.frequency >= band[0]) & (spectra.frequency <= band[1]))
    if not in_band.size:
        lines = spectra.frequency
        raise InputError(
            f"band=({band[0]:g}, {band[1]:g}) was given; one that holds a line is needed, and "
            f"there are {lines.size} from {lines[0]:g} to {lines[-1]:g} Hz."
        )
    return _with_lines(spectra, slice(int(in_band[0]), int(in_band[-1]) + 1))


def _with_lines(spectra: Spectra, lines: slice) -> Spectra:
    return replace(
        spectra,
        frequency=spectra.frequency[lines],
        force=spectra.force[:, lines],
        response=spectra.response[..., lines],
    )


def _thinned(spectra: Spectra, step: int) -> Spectra:
    """Keep every second line with a step of 2, in the middle of those left out."""
    if step == 1:
        return spectra
    words = f"every {step}th line, since the window correlates the errors of neighbouring lines"
    return replace(
        _with_lines(spectra, slice((step - 1) // 2, None, step)),
        correlated_lines=max(1.0, spectra.correlated_lines / step),
        done=(*spectra.done, words),
    )


def _check_options(estimator: str, excitation: object, **counts: int | None) -> None:
    if not isinstance(estimator, str) or estimator not in estimators.ESTIMATORS:
        raise InputError(
            f"estimator={shown(estimator)} was given; one of {', '.join(estimators.ESTIMATORS)} is "
            "needed: estimator='H1' where the response has the most noise."
        )
    check_kind(
        "excitation",
        excitation,
        Excitation,
        "how the structure was excited is needed, since records are cut accordingly",
        "time_records.Impacts(duration=1.0, before=0.02), or time_records.Continuous(segment=1.0)",
    )
    for name, number in counts.items():
        if number is not None:
            check_count(name, number, 1, f"{name}=1")


def _check_spectra(spectra: Spectra) -> None:
    """Refuse a force or a response without any content at a line."""
    power = np.sum(np.abs(np.concatenate([spectra.force[None], spectra.response])) ** 2, axis=1)
    silent = np.argwhere(~(power > 0))
    if silent.size:
        row, line = silent[0].tolist()
        raise InputError(
            f"The {'force' if row == 0 else 'response'} has no content at "
            f"{spectra.frequency[line]:g} Hz; some is needed at every line, since an FRF is their "
            "ratio. Leave such lines out: band=(10.0, 800.0)."
        )


def _resolution(spectra: Spectra, measurement: Measurement, rate: float) -> Iterator[str]:
    if spectra.segment_window is not None and np.all(np.asarray(measurement.variance) > 0):
        yield from _too_short_segments(measurement, spectra.segment_window, rate)


def _alike(spectra: Spectra, estimator: str, step: int) -> Iterator[str]:
    """Say so where repeats show more correlation of neighbouring lines than the windows give."""
    function = estimators.ESTIMATORS[estimator]
    correlated_lines = max(
        estimators.correlated_lines(
            estimators.deviations(function, estimators.products(spectra.force, motion))
        )
        for motion in spectra.response
    )
    if correlated_lines > ALIKE * max(1.0, spectra.correlated_lines):
        yield (
            "What differs from repeat to repeat is alike in neighbouring lines: "
            f"{correlated_lines:.2g} lines count as one independent line, as by noise of a "
            "windowed force. A likelihood counts each line: posteriors are too narrow. Take "
            f"frf_of(..., every={round(correlated_lines) * step}), or the same of frf."
        )


def _warnings(spectra: Spectra) -> Iterator[str]:
    if spectra.averages < FEW_REPEATS:
        yield (
            f"{spectra.averages:.3g} independent repeats know the variance of a line by itself to "
            f"{100 / np.sqrt(spectra.averages - 1):.0f} % only: it rests on the likeness of "
            f"neighbouring lines. Take three or more."
        )
    if spectra.correlated_lines > CORRELATED:
        yield (
            f"Errors of neighbouring lines are correlated: {spectra.correlated_lines:.2g} lines "
            "count as one independent line. A likelihood counts each line: posteriors are too "
            "narrow. Leave every= out, or take frf_of(..., "
            f"every={round(spectra.correlated_lines)}), or the same of frf."
        )


def _too_short_segments(measurement: Measurement, window: Samples, rate: float) -> Iterator[str]:
    """Name the resonance whose peak the window lowers most, if by more than its noise."""
    peaks = resonances((measurement,))
    if not peaks.size:
        return
    indicator = mode_indicator((measurement,))
    widths = [half_power_bandwidth(measurement.frequency, indicator, int(peak)) for peak in peaks]
    biases = np.array([peak_bias(window, rate, width) for width in widths])
    worst = int(np.argmax(biases / _noise_at(measurement, peaks)))
    if biases[worst] > _noise_at(measurement, peaks)[worst]:
        yield (
            f"The resonance at {measurement.frequency[peaks[worst]]:.4g} Hz is "
            f"{widths[worst] * window.size / rate:.2g} lines wide, so that the window lowers its "
            f"peak by {100 * biases[worst]:.2g} %, which is more than its noise and looks like "
            "damping. Take longer segments."
        )


def peak_bias(window: Samples, rate: float, width: float) -> float:
    """Share by which the peak of a resonance of a half-power bandwidth [Hz] is lowered.

    The expectation of Gxy has the impulse response times the autocorrelation of the window (of
    Hann's: 4 / 3 over the square of the lines in the bandwidth). Schmidt, Journal of Sound and
    Vibration 101 (1985) 347.
    """
    count = window.size
    spectrum = np.abs(np.fft.rfft(window, 2 * count)) ** 2
    autocorrelation = np.fft.irfft(spectrum, 2 * count)[:count] / np.sum(window**2)
    decay = np.exp(-np.pi * width * np.arange(count) / rate)
    decay[0] /= 2  # a sum by trapezoids
    endless = 1 / (1 - np.exp(-np.pi * width / rate)) - 0.5  # the same without end
    return float(1 - np.sum(autocorrelation * decay) / endless)


def _noise_at(measurement: Measurement, peaks: Int[np.ndarray, "peak"]) -> np.ndarray:
    """Deviation of the noise over the amplitude at peaks, of the pair where it is least [1]."""
    frf, variance = measurement.frf[..., peaks], measurement.stated_variance()[..., peaks]
    return np.asarray(
        np.sqrt(variance).reshape(-1, peaks.size) / np.abs(frf).reshape(-1, peaks.size)
    ).min(axis=0)
