"""MATLAB files (.mat) of version 5 to 7 as named arrays, by SciPy and pymatreader."""

import warnings
from pathlib import Path

from ..._shared.errors import InputError
from .._gate import existing, reading
from . import _mat_gate
from .named_arrays import NamedArrays, flattened

SPARSE = _mat_gate.SPARSE
_FORM = "a MATLAB 5 to 7 file"
_REMEDY = "Save it again in MATLAB: save('measured.mat', '-v7')."


def load(path: Path) -> NamedArrays:
    """Read the variables of a file; fields of structures are `structure.field`."""
    import pymatreader

    with reading(path, _FORM, _REMEDY):
        variables = _mat_gate.variables(existing(path, "a MATLAB file").read_bytes())
        names = [variable.name for variable in variables if not variable.reason]
        left_out = {variable.name: variable.reason for variable in variables if variable.reason}
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # what a library skips would be missing without a word
            content = pymatreader.read_mat(path, variable_names=names) if names else {}
        loaded = flattened(path, _FORM, {name: content[name] for name in names})
        return loaded._replace(left_out={**left_out, **loaded.left_out})


def refused(path: Path, reason: str) -> InputError:
    """Error of a file that another version of MATLAB wrote."""
    return InputError(f"{path} cannot be read as {_FORM} ({reason}); {_REMEDY}")
