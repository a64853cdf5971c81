"""MDF files (versions 3 and 4) of vehicle tests, by asammdf."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from ..._types import InputError
from .clock import rate_of_times
from .sampled import Sampled, run_library

_SCRIPT = Path(__file__).with_name("_mdf_process.py")
_TIMES = "times of group {}"


def load(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels by their names, with unit and the rate of their time stamps.

    Raises
    ------
    MissingExtraError
        If asammdf is not installed.
    InputError
        If it refuses the file, or the time stamps of these channels are not even or begin at other
        times.
    """
    held = run_library(path, _SCRIPT, "asammdf", extra="mdf", form="MDF")
    groups = held.told["groups"]
    times = {name: held.arrays[_TIMES.format(groups[name])] for name in names if name in groups}
    _check_starts(times)
    return Sampled(
        arrays={name: held.arrays[name] for name in groups},
        units=held.told["units"],
        rates={name: rate_of_times(values) for name, values in times.items()},
        left_out=held.told["faults"],
    )


def _check_starts(times: Mapping[str, np.ndarray]) -> None:
    """Refuse channels of which one began later than another."""
    starts = {name: float(values[0]) for name, values in times.items()}
    if starts and max(starts.values()) > min(starts.values()):
        late = max(starts, key=lambda name: starts[name])
        raise InputError(
            f"{late!r} begins at {starts[late]:g} s and another channel at "
            f"{min(starts.values()):g} s; one start is needed, since force and response are "
            "compared in time. Export them on one time axis (MDF.resample)."
        )
