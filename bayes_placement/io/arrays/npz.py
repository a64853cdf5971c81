"""NumPy archives (.npz) as named arrays."""

from pathlib import Path

from .._npz_archive import NpzArchive
from .named_arrays import NUMBERS, TEXTS, NamedArrays


def load(path: Path) -> NamedArrays:
    """Read the arrays of an archive.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    InputError
        If it is damaged, or holds pickles.
    """
    archive = NpzArchive(path, "measured FRFs")
    read = {name: archive.array(name) for name in archive.names}
    arrays = {name: values for name, values in read.items() if _is_read(values.dtype.kind)}
    left_out = dict.fromkeys(read.keys() - arrays.keys(), "it holds neither numbers nor text")
    return NamedArrays(path, "a NumPy archive", arrays, {}, left_out)


def _is_read(kind: str) -> bool:
    return kind in NUMBERS + TEXTS
