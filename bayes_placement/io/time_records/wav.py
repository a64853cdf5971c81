"""WAV files, whose integers are shares of the full scale."""

import warnings
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from scipy.io import wavfile

from .sampled import Sampled


def load(path: Path, names: Iterable[str]) -> Sampled:
    """Read all channels as `channel 1` and so on; integers as shares of full scale, -1 to 1."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", wavfile.WavFileWarning)  # a file that ends too early
        warnings.filterwarnings("ignore", "Chunk .* not understood", wavfile.WavFileWarning)
        rate, samples = wavfile.read(path)
    columns = _shares(samples if samples.ndim == 2 else samples[:, None]).T
    arrays = {f"channel {number}": column for number, column in enumerate(columns, 1)}
    return Sampled(arrays, {}, dict.fromkeys(arrays, float(rate)))


def _shares(samples: np.ndarray) -> np.ndarray:
    if samples.dtype.kind == "f":
        return samples.astype(float)
    half = 2.0 ** (8 * samples.dtype.itemsize - 1)
    offset = half if samples.dtype.kind == "u" else 0.0  # 8 bits are stored without sign
    return (samples - offset) / half
