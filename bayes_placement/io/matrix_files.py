"""matrix_files: in, sparse matrices in SciPy or Matrix Market files; out, stiffness and mass.

Not known here: nodes, degrees of freedom, the eigenproblem.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.io
import scipy.sparse

from .._types import InputError

_NOISE = 1e-8  # of the largest entry: what assembly in another order leaves


class SystemMatrices(NamedTuple):
    """Symmetric matrices of one size.

    Parameters
    ----------
    stiffness
        Stiffness [N/m], csc.
    mass
        Mass [kg], csc.
    regions
        Stiffness of each region by name, csc.
    """

    stiffness: scipy.sparse.csc_array
    mass: scipy.sparse.csc_array
    regions: dict[str, scipy.sparse.csc_array]


def read(
    stiffness: str | Path,
    mass: str | Path,
    *,
    regions: Mapping[str, str | Path] | None = None,
) -> SystemMatrices:
    """Read stiffness, mass and the stiffness of regions from .npz (SciPy) or .mtx files.

    Symmetric matrices of which only one triangle is stored are completed, whether the file says
    so (Matrix Market) or not.

    Parameters
    ----------
    stiffness, mass
        Files of the matrices in SI, on all degrees of freedom.
    regions
        File of the stiffness of each region, by its name.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If a file holds no such matrix, or the sizes disagree.
    """
    files = {"stiffness": stiffness, "mass": mass} | {
        f"region {name}": path for name, path in (regions or {}).items()
    }
    read_ones = {name: _read_one(Path(path)) for name, path in files.items()}
    return assembled(read_ones, {name: str(path) for name, path in files.items()})


def assembled(
    matrices: Mapping[str, scipy.sparse.csc_array], places: Mapping[str, str]
) -> SystemMatrices:
    """Check matrices that belong together: `stiffness`, `mass`, and any `region NAME`.

    Raises
    ------
    ValueError
        If one is not real, finite, square and symmetric, or has another size than the stiffness.
    """
    whole = {name: _symmetric(matrix, places[name]) for name, matrix in matrices.items()}
    size = whole["stiffness"].shape
    for name, matrix in whole.items():
        if matrix.shape != size:
            raise InputError(
                f"{places[name]} ({name}) has the size {_size(matrix)}, but "
                f"{places['stiffness']} (stiffness) {_size(whole['stiffness'])}; one size is "
                "needed, since rows are the same degrees of freedom. Export all on the same set, "
                "fixed ones included in all or in none."
            )
    regions = {name.removeprefix("region "): one for name, one in whole.items() if " " in name}
    return SystemMatrices(whole["stiffness"], whole["mass"], regions)


def _read_one(path: Path) -> scipy.sparse.csc_array:
    if not path.is_file():
        raise FileNotFoundError(
            f"{path} was given, and there is no such file; a sparse matrix (.npz by SciPy, or .mtx)"
            " is needed. Check the folder: Path(...).resolve()."
        )
    try:
        matrix = _load(path)
    except (ValueError, OSError, EOFError, StopIteration) as error:
        raise InputError(
            f"{path} cannot be read as a sparse matrix ({error}); one matrix that "
            "scipy.sparse.save_npz (.npz) or scipy.io.mmwrite (.mtx, .mtx.gz) wrote is needed. "
            "Write it so."
        ) from error
    return scipy.sparse.csc_array(matrix)


def _load(path: Path) -> Any:
    return scipy.sparse.load_npz(path) if path.suffix == ".npz" else scipy.io.mmread(path)


def _symmetric(matrix: scipy.sparse.csc_array, place: str) -> scipy.sparse.csc_array:
    """Complete a triangle, and refuse what is no real symmetric matrix."""
    if np.iscomplexobj(matrix) or matrix.shape[0] != matrix.shape[1] or not matrix.shape[0]:
        raise _refused(place, f"a {_size(matrix)} matrix of {matrix.dtype.name}")
    if not np.isfinite(matrix.data).all():
        raise _refused(place, "values that are not finite")
    whole = _completed(matrix.astype(float))
    largest = abs(whole).max()
    if largest == 0:
        raise _refused(place, "zeros only")
    if abs(whole - whole.T).max() > _NOISE * largest:
        raise _refused(place, "a matrix that is not symmetric")
    return whole


def _completed(matrix: scipy.sparse.csc_array) -> scipy.sparse.csc_array:
    below, above = scipy.sparse.tril(matrix, -1), scipy.sparse.triu(matrix, 1)
    one_sided = (below.nnz == 0) != (above.nnz == 0)
    if not one_sided:
        return matrix
    return scipy.sparse.csc_array(matrix + below.T + above.T)


def _refused(place: str, holds: str) -> ValueError:
    return ValueError(
        f"{place} holds {holds}; a real, finite, square and symmetric matrix is needed, since "
        "stiffness and mass of an undamped structure are so. Export it without damping, "
        "follower loads and rotor terms, as a whole or as one triangle."
    )


def _size(matrix: scipy.sparse.csc_array) -> str:
    return f"{matrix.shape[0]} x {matrix.shape[1]}"
