"""Files of data recorders: TDMS of LabVIEW, MDF of vehicle tests, by libraries that are extras."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from .. import _reader_process
from .._gate import reading
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


def _read(
    path: Path, form: str, library: str, extra: str
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Arrays by name, and what else the file states."""
    with reading(path, form, "Export it again."):
        needed = _reader_process.ReaderLibrary(library, extra)
        return _reader_process.run(_SCRIPT, path, needed, extra=extra)[:2]
