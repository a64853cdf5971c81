"""HDF5 and MATLAB 7.3 files as named arrays, read in a separate process.

HDF5 ends the interpreter on some damaged files.
"""

from functools import partial
from pathlib import Path

from ..._types import InputError
from .. import _reader_process
from .._gate import existing, reading
from .._limits import check_limit, most
from .named_arrays import NamedArrays

_REMEDY = "Write it again, or take another copy."
_READER = Path(__file__).with_name("_hdf5_process.py")


def load(path: Path) -> NamedArrays:
    """Read the datasets of a file, or the variables of a MATLAB file.

    Links to other files, virtual datasets and filters that HDF5 does not bring are left out.
    """
    refused = partial(_refused, existing(path, "an HDF5 file"))
    what = "unpacked bytes of an HDF5 file"
    result = _reader_process.run(_READER, path, "HDF5", refused, most=most(what))
    metadata = result.metadata
    with reading(path, "HDF5", _REMEDY):
        check_limit(what, metadata.get("bytes", 0))
    return NamedArrays(path, metadata["form"], result.arrays, metadata["units"], metadata["faults"])


def _refused(path: Path, reason: str) -> InputError:
    return InputError(
        f"{path} cannot be read as HDF5 ({reason}); a complete file is needed. {_REMEDY}"
    )
