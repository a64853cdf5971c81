"""Nastran: modes from OUTPUT2 files, stiffness and mass from OUTPUT4 files, by pyyeti."""

import importlib
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from .._types import InputError, MissingExtraError, arguments_checked
from ..modes.finite_elements.modal_model import ModalModel
from .matrix_files import SystemMatrices, system_matrices

_SHAPE_TABLES = ("oug", "bophig")


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
    tables = _tables(Path(path))
    number, shape = _eigenvectors(tables)
    position, rotation = _grids(tables["uset"], number, Path(path))
    signed, mass = _eigenvalues(tables, Path(path))
    order = np.argsort(np.abs(signed), kind="stable")
    shape[:, :3] = _rotated(shape[:, :3], rotation)
    shape[:, 3:] = _rotated(shape[:, 3:], rotation)
    model = ModalModel.from_arrays(
        node=number,
        position=position,
        shape=shape[:, :, order],
        natural_frequency=np.abs(signed)[order],
        modal_mass=mass[order] if modal_mass is None and mass is not None else modal_mass,
        length_unit=length_unit,
        mass_unit=mass_unit,
    )
    _check_stable(signed[order], model.natural_frequency, Path(path))
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
    op4 = _pyyeti("op4", Path(path))
    names = {"stiffness": stiffness, "mass": mass} | {
        f"region {region}": name for region, name in (regions or {}).items()
    }
    wanted = [name.lower() for name in names.values()]
    try:
        names_in_file = op4.dir(str(path), verbose=False)[0]
        content = op4.read(str(path), wanted, sparse=(True, scipy.sparse.csc_array))
    except Exception as error:  # its readers raise any exception
        raise _unreadable(Path(path), "OUTPUT4", error) from error
    _check_names(wanted, names_in_file, Path(path))
    matrices = {role: content[name.lower()] for role, name in names.items()}
    return system_matrices(matrices, {role: f"{path}, {name}" for role, name in names.items()})


def _pyyeti(part: str, path: Path) -> Any:
    try:
        with np.printoptions():  # pyyeti changes how all arrays of the process are printed
            module = importlib.import_module(f"pyyeti.nastran.{part}")
    except ImportError as error:
        raise MissingExtraError(
            f"{path} cannot be read, since pyyeti is not installed, which knows the files of "
            'Nastran. Install it: pip install "bayes_placement[nastran]".'
        ) from error
    if not path.is_file():
        raise FileNotFoundError(
            f"There is no file {path}; a file of Nastran is needed. Check the folder: "
            "Path(...).resolve()."
        )
    return module


def _tables(path: Path) -> dict[str, Any]:
    """Tables of nodes (`uset`), eigenvectors (`oug`) and, if present, eigenvalues (`lama`)."""
    op2 = _pyyeti("op2", path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # other solutions in the file
            warnings.filterwarnings("error", message="(?s).*garbled")
            with op2.OP2(str(path)) as file:
                content = file.rdparampost(get_mats=False, get_ougs=True, get_dr_tables=False)
    except Exception as error:  # its readers raise any exception
        raise _unreadable(path, "OUTPUT2", error) from error
    shapes = [key for key in content if key.startswith(_SHAPE_TABLES) and content[key] is not None]
    if "uset" not in content or len(shapes) != 1:
        nodes = "yes" if "uset" in content else "none"
        raise InputError(
            f"{path} holds eigenvectors {shapes or 'none'}, nodes {nodes}; one table of "
            "eigenvectors (OUG of real modes) and the tables of nodes (GEOM1, BGPDT, EQEXIN) are "
            "needed, since shapes are read at positions. Run SOL 103 with PARAM,POST,-1, "
            "PARAM,OGEOM,YES and DISP(PLOT)=ALL."
        )
    tables = {"uset": content["uset"], "oug": content[shapes[0]]}
    lama = [content[key] for key in content if key.startswith("lama")]
    return tables | ({"lama": lama[-1]} if lama else {})


def _unreadable(path: Path, form: str, error: BaseException) -> InputError:
    return InputError(
        f"{path} cannot be read as {form} ({str(error).strip() or type(error).__name__}); a "
        "complete file of Nastran is needed. Write it again with PARAM,POST,-1, or give the arrays "
        "to ModalModel.from_arrays."
    )


def _eigenvectors(
    tables: dict[str, Any],
) -> tuple[Int[np.ndarray, "node"], Float[np.ndarray, "node 6 mode"]]:
    """Numbers of the grid points, and their motion in their own displacement systems."""
    index = tables["oug"].index
    grid = index.get_level_values("DOF").to_numpy() > 0  # scalar points have no direction
    number = index.get_level_values("Node").to_numpy()[grid][::6]
    values = tables["oug"].to_numpy()[grid]
    return number.astype(np.int64), values.reshape(number.size, 6, -1)


def _grids(
    uset: Any, number: Int[np.ndarray, "node"], path: Path
) -> tuple[Float[np.ndarray, "node 3"], Float[np.ndarray, "node 3 3"]]:
    """Positions in the basic system, and the rotation of motion into that system."""
    from pyyeti.nastran import n2p  # after `op2`, which has imported it

    missing = number[~np.isin(number, uset.index.get_level_values("id"))]
    if missing.size:
        raise InputError(
            f"{path} holds eigenvectors of {missing.size} nodes without coordinates in its tables "
            f"of nodes ({missing[0]} first); one solution on one set of nodes is needed, since "
            "sensors are placed among them. Write the modes of the residual structure, without "
            "those of superelements, into a file of their own."
        )
    grids = uset[uset.index.get_level_values("dof") > 0]
    grids = grids[grids.index.get_level_values("id").isin(number)]
    grids = grids.assign(nasset=n2p.mkusetmask("b"))  # pyyeti gives zeros for some other sets
    known = grids.index.get_level_values("id").to_numpy()[::6]
    row = np.argsort(known)[np.searchsorted(np.sort(known), number)]
    table = grids[["x", "y", "z"]].to_numpy().reshape(-1, 6, 3)
    rotation = np.broadcast_to(np.eye(3), (known.size, 3, 3))
    if table[:, 1, 0].any():  # a displacement system is not the basic system
        rotation = n2p.rbgeom_uset(grids)[:, :3].reshape(-1, 6, 3)[:, :3]
    return table[row, 0], rotation[row]


def _rotated(
    motion: Float[np.ndarray, "node 3 mode"], rotation: Float[np.ndarray, "node 3 3"]
) -> Float[np.ndarray, "node 3 mode"]:
    return np.einsum("nji,njm->nim", rotation.astype(motion.dtype), motion)


def _eigenvalues(
    tables: dict[str, Any], path: Path
) -> tuple[Float[np.ndarray, "mode"], Float[np.ndarray, "mode"] | None]:
    """Natural frequencies [Hz] with the sign of the eigenvalue, and modal masses."""
    of_shapes = tables["oug"].columns.get_level_values(1).to_numpy().astype(float)
    if "lama" not in tables:
        return of_shapes, None
    lama = tables["lama"]
    hertz, mass = np.sign(lama[:, 2]) * lama[:, 4], lama[:, 5]
    agree = hertz.shape == of_shapes.shape and np.allclose(
        np.abs(hertz), of_shapes, rtol=1e-3, atol=1e-6 * of_shapes.max()
    )
    if not agree:
        raise InputError(
            f"{path} holds {of_shapes.size} eigenvectors up to {of_shapes.max():g} Hz and a table "
            f"LAMA of {hertz.size} modes up to {np.abs(hertz).max():g} Hz; those of one solution "
            "are needed, since modal masses belong to shapes. Write one solution into a file of "
            "its own."
        )
    return hertz, mass


def _check_stable(
    signed: Float[np.ndarray, "mode"], frequency: Float[np.ndarray, "mode"], path: Path
) -> None:
    """Refuse negative eigenvalues other than round-off of rigid-body modes."""
    wrong = (signed < 0) & (frequency > 0)
    if wrong.any():
        raise InputError(
            f"{path} holds a negative eigenvalue (mode {int(np.argmax(wrong)) + 1}, "
            f"{signed[wrong][0]:.3g} Hz) that is not round-off of a rigid-body mode, which is "
            "below 1e-3 of the first elastic frequency; positive ones are needed, since an "
            "unstable structure has no response. Compute elastic modes too, or remove the preload."
        )


def _check_names(wanted: list[str], names_in_file: list[str], path: Path) -> None:
    for name in wanted:
        if names_in_file.count(name) != 1:
            raise InputError(
                f"{path} holds the matrices {', '.join(names_in_file).upper()}, {name.upper()} "
                f"{names_in_file.count(name)} times; it is needed once, since matrices are found "
                "by name. Give the name that the file has: "
                'read_matrices(path, stiffness="K", mass="M").'
            )
