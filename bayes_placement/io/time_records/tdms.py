"""TDMS files of LabVIEW, by npTDMS."""

from collections.abc import Iterable
from pathlib import Path

from .clock import check_starts
from .sampled import Sampled, run_library

_SCRIPT = Path(__file__).with_name("_tdms_process.py")


def load(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels, whose names are `group/channel`, with unit and sampling rate."""
    result = run_library(path, _SCRIPT, "nptdms", extra="tdms", form="TDMS")
    metadata = result.metadata
    check_starts({name: metadata["starts"][name] for name in names if name in metadata["starts"]})
    return Sampled(result.arrays, metadata["units"], metadata["rates"], metadata["faults"])
