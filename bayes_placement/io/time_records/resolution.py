"""Whether segments are long enough for the resonances that they show."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Int

from ...experiment.line_choice import half_power_bandwidth, mode_indicator, resonances
from ...experiment.measurement import Measurement
from .records import Samples


def warnings(measurement: Measurement, window: Samples, rate: float) -> Iterator[str]:
    """Name the resonance whose peak the window lowers most, if by more than its noise."""
    peaks = resonances((measurement,))
    if not peaks.size:
        return
    indicator = mode_indicator((measurement,))
    widths = [half_power_bandwidth(measurement.frequency, indicator, int(peak)) for peak in peaks]
    biases = np.array([bias(window, rate, width) for width in widths])
    worst = int(np.argmax(biases / _noise(measurement, peaks)))
    if biases[worst] > _noise(measurement, peaks)[worst]:
        yield (
            f"The resonance at {measurement.frequency[peaks[worst]]:.4g} Hz is "
            f"{widths[worst] * window.size / rate:.2g} lines wide, so that the window lowers its "
            f"peak by {100 * biases[worst]:.2g} %, which is more than its noise and looks like "
            "damping. Take longer segments."
        )


def bias(window: Samples, rate: float, width: float) -> float:
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


def _noise(measurement: Measurement, peaks: Int[np.ndarray, "peak"]) -> np.ndarray:
    """Deviation of the noise over the amplitude at peaks, of the pair where it is least [1]."""
    frf, variance = measurement.frf[..., peaks], measurement.stated_variance()[..., peaks]
    return np.asarray(
        np.sqrt(variance).reshape(-1, peaks.size) / np.abs(frf).reshape(-1, peaks.size)
    ).min(axis=0)
