"""TDMS files of LabVIEW, by npTDMS."""

from collections.abc import Iterable
from pathlib import Path

from .. import _reader_process
from .._gate import reading
from .clock import check_starts
from .sampled import Sampled

_SCRIPT = Path(__file__).with_name("_tdms_process.py")


def load(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels, whose names are `group/channel`, with unit and sampling rate."""
    with reading(path, "a TDMS file", "Export it again."):
        result = _reader_process.run(_SCRIPT, path, _reader_process.ReaderLibrary("nptdms", "tdms"))
    metadata = result.metadata
    check_starts({name: metadata["starts"][name] for name in names if name in metadata["starts"]})
    return Sampled(result.arrays, metadata["units"], metadata["rates"], metadata["faults"])
