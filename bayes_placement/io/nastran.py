"""Nastran: modes from OUTPUT2 files, stiffness and mass from OUTPUT4 files, by pyyeti."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import scipy.sparse
from jaxtyping import Float
from numpy.typing import ArrayLike

from .._shared.arguments import arguments_checked
from .._shared.errors import InputError
from .._shared.files import Json
from ..modes.finite_elements.modal_model import ModalModel
from ._gate import existing, reading
from ._reader_process import run_library
from .matrix_files import SystemMatrices, system_matrices

_REMEDY = "Write it again with PARAM,POST,-1, or give the arrays to ModalModel.from_arrays."


@arguments_checked
def read_modes(
    path: str | Path,
    *,
    modal_mass: ArrayLike | float | int | None = None,
    length_unit: float = 1.0,
    mass_unit: float = 1.0,
) -> ModalModel:
    """Read nodes and real normal modes of an OUTPUT2 file (`PARAM,POST,-1`), by pyyeti.

    Coordinates are those of BGPDT in the basic system; eigenvectors (OUG, of the last solution in
    the file, single precision) are rotated from the displacement systems of the nodes to the
    basic system; frequencies and modal masses come from LAMA. Scalar points are left out, as are
    directions in which nothing moves; of superelements only the residual structure is read.
    Negative eigenvalues as small as those of rigid-body modes count as rigid-body modes.

    Parameters
    ----------
    path
        The file, usually `.op2`.
    modal_mass
        Modal masses in the unit of the file, in ascending order of the natural frequencies, where
        it has no LAMA; 1 if the modes are mass-normalised (`EIGRL` with `NORM=MASS`).
    length_unit, mass_unit
        What one unit of the model is in metres and kilograms, which Nastran does not say: 1e-3
        and 1e3 for mm, t and N.

    Returns
    -------
    ModalModel
        Nodes and modes in SI.

    Raises
    ------
    MissingExtraError
        If pyyeti is not installed.
    FileNotFoundError
        If there is no such file.
    ValueError
        If it lacks nodes or modes, or the arrays do not make a modal model.

    Examples
    --------
    >>> model = bp.io.nastran.read_modes("frame.op2", length_unit=1e-3)  # doctest: +SKIP
    """
    file = existing(Path(path), "a file of Nastran")
    with reading(file, "OUTPUT2", _REMEDY):
        arrays, found, _ = run_library(file, "nastran", names=[])
        _check_tables(found)
        signed, mass = _eigenvalues(arrays)
        order = np.argsort(np.abs(signed), kind="stable")
        model = ModalModel.from_arrays(
            node=arrays["node"],
            position=arrays["position"],
            shape=arrays["shape"][:, :, order],
            natural_frequency=np.abs(signed)[order],
            modal_mass=mass[order] if modal_mass is None and mass is not None else modal_mass,
            length_unit=length_unit,
            mass_unit=mass_unit,
        )
        _check_stable(signed[order], model.natural_frequency)
        return model.without_unused_directions()


@arguments_checked
def read_matrices(
    path: str | Path,
    *,
    stiffness: str = "KAA",
    mass: str = "MAA",
    regions: Mapping[str, str] | None = None,
) -> SystemMatrices:
    """Read stiffness and mass by name from an OUTPUT4 file in SI, by pyyeti.

    Parameters
    ----------
    path
        The file, usually `.op4`, binary or text, dense or sparse.
    stiffness, mass
        Names of the matrices in the file, in upper or lower case.
    regions
        Name of the matrix of each region, by the name of the region.

    Returns
    -------
    SystemMatrices
        `stiffness`, `mass` and `regions`, in the units of the file.

    Raises
    ------
    MissingExtraError
        If pyyeti is not installed.
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file does not hold each of these matrices once, or they do not belong together.

    Examples
    --------
    >>> bp.io.nastran.read_matrices("frame.op4", stiffness="KAA", mass="MAA")  # doctest: +SKIP
    """
    names = {"stiffness": stiffness, "mass": mass} | {
        f"region {region}": name for region, name in (regions or {}).items()
    }
    file = existing(Path(path), "a file of Nastran")
    with reading(file, "OUTPUT4", _REMEDY):
        wanted = [name.lower() for name in names.values()]
        arrays, found, _ = run_library(file, "nastran", names=wanted)
        _check_names([*names.values()], found["in file"])
        matrices = {role: _matrix(arrays, name.lower()) for role, name in names.items()}
        return system_matrices(matrices, {role: f"{path}, {name}" for role, name in names.items()})


def _matrix(arrays: dict[str, np.ndarray], name: str) -> scipy.sparse.csc_array:
    row, column, value, size = (arrays[f"{name} {x}"] for x in ("row", "column", "value", "size"))
    return scipy.sparse.csc_array((value, (row, column)), shape=tuple(size.tolist()))


def _check_tables(found: Json) -> None:
    shapes, unplaced = found["eigenvectors"], found["unplaced"]
    if not found["nodes"] or len(shapes) != 1:
        raise InputError(
            f"it holds eigenvectors {shapes or 'none'}, nodes "
            f"{'yes' if found['nodes'] else 'none'}; one table of eigenvectors (OUG of real modes) "
            "and the tables of nodes (GEOM1, BGPDT, EQEXIN) are needed, since shapes are read at "
            "positions. Run SOL 103 with PARAM,POST,-1, PARAM,OGEOM,YES and DISP(PLOT)=ALL."
        )
    if unplaced:
        raise InputError(
            f"it holds eigenvectors of {len(unplaced)} nodes without coordinates in its tables of "
            f"nodes ({unplaced[0]} first); one solution on one set of nodes is needed, since "
            "sensors are placed among them. Write the modes of the residual structure, without "
            "those of superelements, into a file of their own."
        )


def _eigenvalues(
    arrays: dict[str, np.ndarray],
) -> tuple[Float[np.ndarray, "mode"], Float[np.ndarray, "mode"] | None]:
    """Natural frequencies [Hz] with the sign of the eigenvalue, and modal masses."""
    of_shapes = arrays["frequency"]
    if "eigenvalues" not in arrays:
        return of_shapes, None
    table = arrays["eigenvalues"]
    hertz, mass = np.sign(table[:, 2]) * table[:, 4], table[:, 5]
    agree = hertz.shape == of_shapes.shape and np.allclose(
        np.abs(hertz), of_shapes, rtol=1e-3, atol=1e-6 * of_shapes.max()
    )
    if not agree:
        raise InputError(
            f"it holds {of_shapes.size} eigenvectors up to {of_shapes.max():g} Hz and a table "
            f"LAMA of {hertz.size} modes up to {np.abs(hertz).max():g} Hz; those of one solution "
            "are needed, since modal masses belong to shapes. Write one solution into a file of "
            "its own."
        )
    return hertz, mass


def _check_stable(signed: Float[np.ndarray, "mode"], frequency: Float[np.ndarray, "mode"]) -> None:
    """Refuse negative eigenvalues other than round-off of rigid-body modes."""
    wrong = (signed < 0) & (frequency > 0)
    if wrong.any():
        raise InputError(
            f"it holds a negative eigenvalue (mode {int(np.argmax(wrong)) + 1}, "
            f"{signed[wrong][0]:.3g} Hz) that is not round-off of a rigid-body mode, which is "
            "below 1e-3 of the first elastic frequency; positive ones are needed, since an "
            "unstable structure has no response. Compute elastic modes too, or remove the preload."
        )


def _check_names(wanted: list[str], names_in_file: list[str]) -> None:
    for name in wanted:
        count = names_in_file.count(name.lower())
        if count != 1:
            raise InputError(
                f"it holds the matrices {', '.join(names_in_file).upper()}, {name.upper()} {count} "
                "times; it is needed once, since matrices are found by name. Give the name that "
                'the file has: read_matrices(path, stiffness="K", mass="M").'
            )
