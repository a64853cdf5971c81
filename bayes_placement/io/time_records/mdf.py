"""MDF files (versions 3 and 4) of vehicle tests, by asammdf."""

from collections.abc import Iterable
from pathlib import Path

from .. import _reader_process
from .._gate import reading
from .clock import check_starts, rate_of_times
from .sampled import Sampled

_SCRIPT = Path(__file__).with_name("_mdf_process.py")
_TIMES = "times of group {}"


def load(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels by their names, with unit and the rate of their time stamps."""
    with reading(path, "an MDF file", "Export it again."):
        result = _reader_process.run(_SCRIPT, path, _reader_process.ReaderLibrary("asammdf", "mdf"))
    groups = result.metadata["groups"]
    times = {name: result.arrays[_TIMES.format(groups[name])] for name in names if name in groups}
    check_starts({name: float(values[0]) for name, values in times.items()})
    return Sampled(
        arrays={name: result.arrays[name] for name in groups},
        units=result.metadata["units"],
        rates={name: rate_of_times(values) for name, values in times.items()},
        left_out=result.metadata["faults"],
    )
