"""Named arrays of any file, by what its bytes say it is."""

from collections.abc import Callable
from pathlib import Path

from ..._shared.arguments import arguments_checked
from ..._shared.errors import InputError
from .. import _contents
from .._gate import existing
from . import binary, text, text_blocks, workbook
from .named_arrays import NamedArrays

LOADERS: dict[str, Callable[[Path], NamedArrays]] = {
    _contents.MAT: binary.load_mat,
    _contents.MAT_HDF5: binary.load_hdf5,
    _contents.HDF5: binary.load_hdf5,
    _contents.NPZ: binary.load_npz,
    _contents.NPY: binary.load_npy,
    _contents.WORKBOOK: workbook.load,
    _contents.TEXT: text_blocks.load,
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
