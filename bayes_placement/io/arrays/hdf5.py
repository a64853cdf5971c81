"""HDF5 and MATLAB 7.3 files as named arrays, read in a separate process.

HDF5 ends the interpreter on some damaged files.
"""

from pathlib import Path

from .. import _reader_process
from .._gate import existing, reading
from .._limits import check_limit, most
from .named_arrays import NamedArrays

_READER = Path(__file__).with_name("_hdf5_process.py")


def load(path: Path) -> NamedArrays:
    """Read the datasets of a file, or the variables of a MATLAB file.

    Links to other files, virtual datasets and filters that HDF5 does not bring are left out.
    """
    what = "unpacked bytes of an HDF5 file"
    file = existing(path, "an HDF5 file")
    with reading(file, "HDF5", "Write it again, or take another copy."):
        arrays, metadata, _ = _reader_process.run(_READER, file, most=most(what))
        check_limit(what, metadata.get("bytes", 0))
    return NamedArrays(path, metadata["form"], arrays, metadata["units"], metadata["faults"])
