"""TDMS files of LabVIEW, by npTDMS."""

from collections.abc import Iterable
from pathlib import Path

from .clock import check_starts
from .sampled import Sampled, run_library

_SCRIPT = Path(__file__).with_name("_tdms_process.py")


def load(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels, whose names are `group/channel`, with unit and sampling rate.

    Raises
    ------
    MissingExtraError
        If npTDMS is not installed.
    InputError
        If it refuses the file, or these channels begin at other times.
    """
    held = run_library(path, _SCRIPT, "nptdms", extra="tdms", form="TDMS")
    told = held.told
    check_starts({name: told["starts"][name] for name in names if name in told["starts"]})
    return Sampled(held.arrays, told["units"], told["rates"], told["faults"])
