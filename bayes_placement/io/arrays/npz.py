"""NumPy archives (.npz) and single arrays (.npy) as named arrays."""

from pathlib import Path

from ..._shared.errors import InputError
from .._gate import existing, reading
from .._npz_archive import NpzArchive, array_in
from .named_arrays import NUMBERS, TEXTS, NamedArrays


def load(path: Path) -> NamedArrays:
    """Read the arrays of an archive."""
    archive = NpzArchive(path, "measured FRFs")
    read = {name: archive.array(name) for name in archive.names}
    arrays = {name: values for name, values in read.items() if _is_read(values.dtype.kind)}
    left_out = dict.fromkeys(read.keys() - arrays.keys(), "it holds neither numbers nor text")
    return NamedArrays(path, "a NumPy archive", arrays, {}, left_out)


def load_array(path: Path) -> NamedArrays:
    """Read the array of a file, which has the name of the file."""
    form = "a NumPy array"
    with reading(path, form, "Write it again with numpy.save."):
        with existing(path, form).open("rb") as stream:
            values = array_in(stream, path.stat().st_size)
        if not _is_read(values.dtype.kind):
            raise InputError(f"it holds {values.dtype}, which are neither numbers nor text")
        return NamedArrays(path, form, {path.stem: values}, {}, {})


def _is_read(kind: str) -> bool:
    return kind in NUMBERS + TEXTS
