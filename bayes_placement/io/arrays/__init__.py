"""Files of arrays by what their bytes say: MATLAB, NumPy, HDF5, columns of text, workbooks."""

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..._shared.arguments import arguments_checked
from ..._shared.errors import InputError
from .. import _contents, _reader_process
from .._gate import check_limit, existing, most, reading
from .._npz_archive import NpzArchive, array_in
from . import _mat_gate, text, workbook
from .named_arrays import NUMBERS, TEXTS, NamedArrays

__all__ = ["NamedArrays", "load"]

_MAT, _SAVE_AGAIN = "a MATLAB 5 to 7 file", "Save it again in MATLAB: save('measured.mat', '-v7')."
_READER = Path(__file__).with_name("_hdf5_process.py")


def load_mat(path: Path) -> NamedArrays:
    """Read the variables of versions 5 to 7; fields of structures are `structure.field`."""
    import pymatreader

    from ._hdf5_process import collect  # with h5py

    with reading(path, _MAT, _SAVE_AGAIN):
        variables = _mat_gate.variables(existing(path, "a MATLAB file").read_bytes())
        names = [name for name, reason in variables.items() if not reason]
        left_out = {name: reason for name, reason in variables.items() if reason}
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # what a library skips would be missing without a word
            content = pymatreader.read_mat(path, variable_names=names) if names else {}
        arrays: dict[str, np.ndarray] = {}
        collect({name: content[name] for name in names}, "", arrays, left_out)
        return NamedArrays(path, _MAT, arrays, {}, left_out)


def load_hdf5(path: Path) -> NamedArrays:
    """Read the datasets of a file, or the variables of one of MATLAB 7.3.

    HDF5 ends the interpreter on some damaged files: they are read in a separate process. Links to
    other files, virtual datasets and filters that HDF5 does not bring are left out.
    """
    what = "unpacked bytes of an HDF5 file"
    file = existing(path, "an HDF5 file")
    with reading(file, "HDF5", "Write it again, or take another copy."):
        arrays, metadata, _ = _reader_process.run(_READER, file, most=most(what))
        check_limit(what, metadata.get("bytes", 0))
    return NamedArrays(path, metadata["form"], arrays, metadata["units"], metadata["faults"])


def load_npz(path: Path) -> NamedArrays:
    """Read the arrays of an archive."""
    archive = NpzArchive(path, "measured FRFs")
    read = {name: archive.array(name) for name in archive.names}
    arrays = {name: values for name, values in read.items() if _is_read(values.dtype.kind)}
    left_out = dict.fromkeys(read.keys() - arrays.keys(), "it holds neither numbers nor text")
    return NamedArrays(path, "a NumPy archive", arrays, {}, left_out)


def load_npy(path: Path) -> NamedArrays:
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


LOADERS: dict[str, Callable[[Path], NamedArrays]] = {
    _contents.MAT: load_mat,
    _contents.MAT_HDF5: load_hdf5,
    _contents.HDF5: load_hdf5,
    _contents.NPZ: load_npz,
    _contents.NPY: load_npy,
    _contents.WORKBOOK: workbook.load,
    _contents.TEXT: text.load_text,
    _contents.ABAQUS_MATRIX: text.load,  # five columns of numbers may be anything
}

_NAMES = [content for content in LOADERS if content != _contents.ABAQUS_MATRIX]


@arguments_checked
def load(path: Path) -> NamedArrays:
    """Read the arrays of a file.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    InputError
        If it is none of these, or its reader refuses it.

    Examples
    --------
    >>> from pathlib import Path
    >>> np.savez("measured.npz", frequency=experiment.frequency)
    >>> bp.io.arrays.load(Path("measured.npz")).arrays["frequency"][:2]
    array([100., 150.])
    """
    content = _contents.content_of(existing(path, "a file of measured FRFs"))
    if content not in LOADERS:
        raise InputError(
            f"{path} {_contents.described(path)}; arrays are needed, of {', '.join(_NAMES)}. "
            "Read it as what it is, or export it again, in MATLAB by save('measured.mat', '-v7')."
        )
    loaded = LOADERS[content](path)
    wrong = [
        name for name in loaded.arrays if not name.isprintable() or len(name) > text.LONGEST_NAME
    ]
    left_out = dict.fromkeys(map(ascii, wrong), "its name is too long or cannot be printed")
    arrays = {name: values for name, values in loaded.arrays.items() if name not in wrong}
    return loaded._replace(arrays=arrays, left_out={**loaded.left_out, **left_out})
