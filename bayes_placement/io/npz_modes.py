"""Nodes and modes in NumPy files (.npz), in SI, read and written as a modal model.

The layout: one array for each name; `read` also understands the names in brackets.

===================  ================  ============================================================
`position`           `[node, 3]`       coordinates [m] (`nodes`, `coordinates`, `node_position_m`)
`shape`              `[dof, mode]`     mode shapes, or `[node, axis, mode]` without `dof` (`modes`,
                                       `shapes`, `mode_shapes`)
`natural_frequency`  `[mode]`          natural frequencies [Hz] (`freqs_hz`, `frequency_hz`)
`modal_mass`         `[mode]`          modal masses [kg] (`modal_masses`)
`node`               `[node]`          node numbers, else 1, 2, 3 ... (`node_ids`)
`dof`                `[dof, 2]`        node number and direction 1 to 7 of each row (`dofs`)
`damping_ratio`      `[mode]`          modal damping ratios, optional (`modal_damping`)
`fixed`              `[fixed]`         rows of `dof` that are fixed, optional (`fixed_dofs`)
`element`            `[element, k]`    nodes of each element, optional (`elements`)
===================  ================  ============================================================
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import BadZipFile

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from .._files import write_atomically
from .._types import InputError
from ..modes.finite_elements.modal_model import ModalModel

_NAMES = {
    "position": ("position", "nodes", "coordinates", "node_position_m"),
    "shape": ("shape", "modes", "shapes", "mode_shapes"),
    "natural_frequency": ("natural_frequency", "freqs_hz", "frequency_hz"),
    "modal_mass": ("modal_mass", "modal_masses"),
    "node": ("node", "node_ids"),
    "dof": ("dof", "dofs"),
    "damping_ratio": ("damping_ratio", "modal_damping"),
    "fixed": ("fixed", "fixed_dofs"),
    "element": ("element", "elements"),
}
_REQUIRED = ("position", "shape", "natural_frequency")
_MODAL = (*_REQUIRED, "modal_mass", "node", "dof", "damping_ratio")


class ModelNodes(NamedTuple):
    """Nodes and degrees of freedom of a finite element model, without modes.

    Parameters
    ----------
    node
        Number of each node.
    position
        Its coordinates [m].
    dof
        Node number and direction (1 to 7) of each degree of freedom.
    fixed
        Rows of `dof` that are fixed; empty where the file names none.
    element
        Nodes of each element; None where the file has none.
    """

    node: Int[np.ndarray, "node"]
    position: Float[np.ndarray, "node 3"]
    dof: Int[np.ndarray, "dof 2"]
    fixed: Int[np.ndarray, "fixed"]
    element: Int[np.ndarray, "element corner"] | None


def read(path: str | Path, *, modal_mass: ArrayLike | float | int | None = None) -> ModalModel:
    """Read nodes and modes; shapes keep their precision and are in memory twice at most.

    Parameters
    ----------
    path
        The file, in the layout of this module, in SI.
    modal_mass
        Modal masses [kg] where the file holds none; 1 if the shapes are mass-normalised.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If it is not such a file, lacks an array, or its arrays do not make a modal model.
    """
    with _opened(Path(path)) as file:
        arrays: dict[str, Any] = _arrays(file, Path(path), _MODAL, required=_REQUIRED)
    if modal_mass is not None:
        arrays["modal_mass"] = np.asarray(modal_mass)
    return ModalModel.from_arrays(**arrays)


def read_nodes(path: str | Path) -> ModelNodes:
    """Read nodes and degrees of freedom only, such as those of stiffness and mass matrices.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If it is not such a file or lacks an array.
    """
    with _opened(Path(path)) as file:
        wanted = ("position", "node", "dof", "fixed", "element")
        arrays = _arrays(file, Path(path), wanted, required=("position", "dof"))
    count = len(arrays["position"])
    return ModelNodes(
        node=arrays.get("node", np.arange(1, count + 1)),
        position=arrays["position"].astype(float),
        dof=arrays["dof"],
        fixed=arrays.get("fixed", np.zeros(0, dtype=int)),
        element=arrays.get("element"),
    )


def write(path: str | Path, model: ModalModel) -> Path:
    """Write a modal model in the layout of this module; the file is complete before it is replaced.

    Parameters
    ----------
    path
        The file, ending in .npz.
    model
        The model; its shapes are mass-normalised, so that all modal masses are 1.

    Raises
    ------
    ValueError
        If the path has another ending.
    """
    if Path(path).suffix != ".npz":
        raise InputError(
            f"{path} was given; a name that ends in .npz is needed, since readers go by it. "
            f"Write to {Path(path).with_suffix('.npz')}."
        )
    arrays = {name: getattr(model, name) for name in ("node", "position", "dof", "shape")}
    arrays["natural_frequency"] = model.natural_frequency
    arrays["modal_mass"] = np.ones(model.natural_frequency.size)
    if model.damping_ratio is not None:
        arrays["damping_ratio"] = model.damping_ratio
    return write_atomically(path, lambda temporary: np.savez(temporary, **arrays))


@contextmanager
def _opened(path: Path) -> Iterator[np.lib.npyio.NpzFile]:
    if not path.is_file():
        raise FileNotFoundError(
            f"There is no file {path}; a .npz file of nodes and modes is needed. Check the folder: "
            "Path(...).resolve()."
        )
    with path.open("rb") as handle:
        try:
            file = np.load(handle, allow_pickle=False)
        except (ValueError, EOFError, BadZipFile) as error:
            raise _not_npz(path, str(error)) from error
        if not isinstance(file, np.lib.npyio.NpzFile):
            raise _not_npz(path, "it is a single array")
        yield file


def _not_npz(path: Path, reason: str) -> InputError:
    return InputError(
        f"{path} cannot be read as .npz ({reason}); named arrays are needed, positions of nodes "
        "and shapes among them. Write it with numpy.savez(path, position=..., shape=..., ...)."
    )


def _arrays(
    file: np.lib.npyio.NpzFile, path: Path, wanted: tuple[str, ...], required: tuple[str, ...]
) -> dict[str, Any]:
    """Arrays of a file by the first of their names, whatever name they have in the file."""
    aliases = {name: [alias for alias in _NAMES[name] if alias in file.files] for name in wanted}
    for name in wanted:
        if len(aliases[name]) > 1 or (name in required and not aliases[name]):
            contents = "both " + " and ".join(aliases[name]) if aliases[name] else f"no {name}"
            raise InputError(
                f"{path} holds {contents}, among {', '.join(file.files)}; one array named "
                f"{' or '.join(_NAMES[name])} is needed, since a model has its {name} once. Write "
                f"it with numpy.savez(path, {name}=..., ...), in SI."
            )
    return {name: _member(file, names[0], path) for name, names in aliases.items() if names}


def _member(file: np.lib.npyio.NpzFile, name: str, path: Path) -> np.ndarray:
    try:
        return file[name]
    except (ValueError, EOFError, BadZipFile) as error:
        raise _not_npz(path, f"array {name}: {error}") from error
