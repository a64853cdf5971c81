"""TDMS files of LabVIEW, by npTDMS."""

from collections.abc import Iterable
from pathlib import Path

from .sampled import Sampled, run_library

_SCRIPT = Path(__file__).with_name("_tdms_process.py")


def load(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels, whose names are `group/channel`, with unit and sampling interval.

    Raises
    ------
    MissingExtraError
        If npTDMS is not installed.
    InputError
        If it refuses the file.
    """
    held = run_library(path, _SCRIPT, "nptdms", extra="tdms", form="TDMS")
    told = held.told
    return Sampled(held.arrays, told["units"], told["rates"], told["faults"])
