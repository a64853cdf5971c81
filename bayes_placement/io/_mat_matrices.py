"""Stiffness and mass among the variables of a MATLAB file, full or sparse, by their names."""

import re
import warnings
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse

from .._shared.errors import InputError
from . import _contents as content
from . import arrays
from .arrays._mat_gate import SPARSE

KINDS = (content.MAT, content.MAT_HDF5)
NAMES = {"stiffness": r"k\d*|k_?[a-z]{1,3}|stiff\w*", "mass": r"m\d*|m_?[a-z]{1,3}|mass\w*"}
"""What the names of matrices look like, in lower case."""


def matrix(path: Path, role: str) -> scipy.sparse.csc_array:
    """Return `stiffness` or `mass`: the only matrix in the file, or of such a name."""
    square = {n: m for n, m in _matrices(path).items() if m.ndim == 2 and m.shape[0] == m.shape[1]}
    square = {name: values for name, values in square.items() if values.shape[0] > 1}
    named = [name for name in square if re.fullmatch(NAMES.get(role, ""), _last(name))]
    found = named if len(square) > 1 else [*square]
    if len(found) != 1:
        known = ", ".join(f"{name} ({'x'.join(map(str, m.shape))})" for name, m in square.items())
        raise InputError(
            f"it holds the square matrices {known or 'none'}, of which {', '.join(found) or 'none'}"
            f" may be the {role} by name; one is needed, since it is not guessed. Save it alone, "
            f"with the name {'K' if role == 'stiffness' else 'M'}: save('system.mat', 'K', 'M')."
        )
    return scipy.sparse.csc_array(square[found[0]])


def _last(name: str) -> str:
    """Name of a variable, or of a field of a structure, in lower case."""
    return name.rpartition(".")[2].lower()


def _matrices(path: Path) -> dict[str, np.ndarray | scipy.sparse.csc_array]:
    """Full matrices, and sparse ones, whose indices the gate has checked."""
    loaded = arrays.load(path)
    sparse = [name for name, reason in loaded.left_out.items() if reason == SPARSE]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        content = scipy.io.loadmat(path, variable_names=sparse) if sparse else {}
    return {
        **{name: values for name, values in loaded.arrays.items() if values.dtype.kind in "iufc"},
        **{name: scipy.sparse.csc_array(content[name]) for name in sparse},
    }
