"""Time records of WAV and universal files, and of TDMS and MDF by libraries that are extras."""

import os
import struct
import warnings
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from scipy.io import wavfile

from ..._shared.errors import InputError
from ..._shared.files import Json
from ...positions.channel import Channel
from .. import _reader_process
from .._gate import reading
from ..uff._datasets import FUNCTION, Dataset, MeasurementFileError
from ..uff._datasets import load as datasets_of
from .clock import Sampled, check_starts, rate_of_times

_SCRIPT = Path(__file__).with_name("_recorder_process.py")
_TIMES = "times of group {}"


def load_tdms(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels, whose names are `group/channel`, with unit and sampling rate."""
    arrays, metadata = _read(path, "a TDMS file", "nptdms", "tdms")
    check_starts({name: metadata["starts"][name] for name in names if name in metadata["starts"]})
    return Sampled(arrays, metadata["units"], metadata["rates"], metadata["faults"])


def load_mdf(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels of versions 3 and 4 by name, with unit and the rate of their time stamps."""
    arrays, metadata = _read(path, "an MDF file", "asammdf", "mdf")
    groups = metadata["groups"]
    times = {name: arrays[_TIMES.format(groups[name])] for name in names if name in groups}
    check_starts({name: float(values[0]) for name, values in times.items()})
    return Sampled(
        arrays={name: arrays[name] for name in groups},
        units=metadata["units"],
        rates={name: rate_of_times(values) for name, values in times.items()},
        left_out=metadata["faults"],
    )


def _read(path: Path, form: str, library: str, extra: str) -> tuple[dict[str, np.ndarray], Json]:
    """Arrays by name, and what else the file states."""
    with reading(path, form, "Export it again."):
        needed = _reader_process.ReaderLibrary(library, extra)
        return _reader_process.run(_SCRIPT, path, needed, extra=extra)[:2]


def load_wav(path: Path, names: Iterable[str]) -> Sampled:
    """Read all channels as `channel 1` and so on; integers as shares of full scale, -1 to 1."""
    _check_parts(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error", wavfile.WavFileWarning)  # a file that ends too early
        warnings.filterwarnings("ignore", "Chunk .* not understood", wavfile.WavFileWarning)
        rate, samples = wavfile.read(path)
    columns = _shares(samples if samples.ndim == 2 else samples[:, None]).T
    arrays = {f"channel {number}": column for number, column in enumerate(columns, 1)}
    return Sampled(arrays, {}, dict.fromkeys(arrays, float(rate)))


def _check_parts(path: Path) -> None:
    """Refuse parts that do not follow each other, as where a recorder ended before it noted sizes.

    Those of RF64 stand elsewhere, and are compared by SciPy.
    """
    length = path.stat().st_size
    with path.open("rb") as file:
        form, whole, _ = struct.unpack("<4sI4s", file.read(12))
        while form == b"RIFF" and file.tell() < (whole + 8 if whole else length):
            name, size = struct.unpack("<4sI", file.read(8))
            left = length - file.tell()
            readable = name.decode("latin-1").isprintable() and size <= left
            if not readable or (name == b"data" and not size):
                raise InputError(
                    f"its part {name!r} announces {size} bytes and {left} are left in the file; as "
                    "many as there are must be announced, since others would be lost without a "
                    "word. Write the sizes anew: sox --ignore-length in.wav out.wav"
                )
            file.seek(size + size % 2, os.SEEK_CUR)


def _shares(samples: np.ndarray) -> np.ndarray:
    if samples.dtype.kind == "f":
        return samples.astype(float)
    half = 2.0 ** (8 * samples.dtype.itemsize - 1)
    offset = half if samples.dtype.kind == "u" else 0.0  # 8 bits are stored without sign
    return (samples - offset) / half


TIME_RESPONSE = 1
_TIME = 17  # data type of the abscissa
_UNSTATED = ("", "NONE")


def load_universal(path: Path, names: Iterable[str]) -> Sampled:
    """Read time histories by node and direction (`12+z`), with unit and sampling rate.

    Further records of one node and direction are `12+z (2)` and so on.
    """
    functions = [dataset for dataset in datasets_of(path) if dataset.number == FUNCTION]
    records = _named([one for one in functions if one.fields["func_type"] == TIME_RESPONSE])
    if not records:
        types = sorted({dataset.fields["func_type"] for dataset in functions})
        raise MeasurementFileError(
            f"{path} holds {f'functions of type {types}' if types else 'no function'}; time "
            f"histories (dataset 58, function type {TIME_RESPONSE}) are needed here. FRFs are read "
            "by bp.io.read(path)."
        )
    times = {name: np.asarray(record.fields["x"], float) for name, record in records.items()}
    check_starts({name: float(times[name][0]) for name in names if name in times})
    return Sampled(
        arrays={name: np.asarray(record.fields["data"]) for name, record in records.items()},
        units={name: _unit(record) for name, record in records.items()},
        rates={name: rate_of_times(values) for name, values in times.items()},
    )


def _named(datasets: list[Dataset]) -> dict[str, Dataset]:
    seen: Counter[str] = Counter()
    named = {}
    for dataset in datasets:
        _check_abscissa(dataset)
        fields = dataset.fields
        node, direction = str(fields["rsp_node"]), fields["rsp_dir"]
        is_translation = abs(direction) <= 3
        label = (
            Channel(node, direction).label if is_translation else f"{node} direction {direction}"
        )
        seen[label] += 1
        named[f"{label} ({seen[label]})" if seen[label] > 1 else label] = dataset
    return named


def _check_abscissa(dataset: Dataset) -> None:
    kind = dataset.fields["abscissa_spec_data_type"]
    label = dataset.fields["abscissa_axis_units_lab"].strip()
    if kind != _TIME or label not in (*_UNSTATED, "s", "sec"):
        raise MeasurementFileError(
            f"{dataset.place} is a time history over data type {kind} in {label!r}; time (17) in s "
            "is needed, since the sampling rate follows from it. Export it over seconds."
        )


def _unit(dataset: Dataset) -> str:
    label: str = dataset.fields["ordinate_axis_units_lab"].strip()
    return "" if label in _UNSTATED else label
