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

import difflib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from .._shared.arguments import arguments_checked
from .._shared.errors import InputError
from .._shared.files import write_atomically
from .._shared.reprs import with_short_repr
from ..modes.finite_elements.modal_model import ModalModel
from ._gate import check_plausible, reading
from ._npz_archive import NpzArchive

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
_ALIKE = 0.8  # likeness from which on a name is a misspelt one
_REMEDY = "Write it with numpy.savez(path, position=..., shape=..., ...)."
_MODAL = (*_REQUIRED, "modal_mass", "node", "dof", "damping_ratio")


@with_short_repr
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

    Examples
    --------
    >>> np.savez("nodes.npz", position=plane.position, node=plane.node, dof=plane.dof)
    >>> bp.io.npz_modes.read_nodes("nodes.npz").position.shape
    (9, 3)
    """

    node: Int[np.ndarray, "node"]
    position: Float[np.ndarray, "node 3"]
    dof: Int[np.ndarray, "dof 2"]
    fixed: Int[np.ndarray, "fixed"]
    element: Int[np.ndarray, "element corner"] | None


@arguments_checked
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

    Examples
    --------
    >>> path = bp.io.npz_modes.write("modes.npz", plane)
    >>> bp.io.npz_modes.read("modes.npz").natural_frequency
    array([120., 300.])
    """
    with reading(Path(path), "a modal model", _REMEDY):
        arrays: dict[str, Any] = _arrays(Path(path), _MODAL, required=_REQUIRED)
        if modal_mass is not None:
            arrays["modal_mass"] = np.asarray(modal_mass)
        model = ModalModel.from_arrays(**arrays)
        check_plausible(Path(path), **{"mass-normalised shape": model.shape})
        return model


@arguments_checked
def read_nodes(path: str | Path) -> ModelNodes:
    """Read nodes and degrees of freedom only, such as those of stiffness and mass matrices.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If it is not such a file or lacks an array.

    Examples
    --------
    >>> np.savez("nodes.npz", position=plane.position, node=plane.node, dof=plane.dof)
    >>> bp.io.npz_modes.read_nodes("nodes.npz").node
    array([1, 2, 3, 4, 5, 6, 7, 8, 9])
    """
    with reading(Path(path), "nodes of a model", _REMEDY):
        wanted = ("position", "node", "dof", "fixed", "element")
        return _model_nodes(Path(path), _arrays(Path(path), wanted, ("position", "dof")))


def _model_nodes(path: Path, arrays: dict[str, np.ndarray]) -> ModelNodes:
    """Nodes and degrees of freedom, once they refer to each other."""
    count, element = len(arrays["position"]), arrays.get("element")
    nodes = ModelNodes(
        node=_integers(path, "node", arrays.get("node", np.arange(1, count + 1)), (count,)),
        position=_shaped(path, "position", arrays["position"].astype(float), (count, 3)),
        dof=_integers(path, "dof", arrays["dof"], (len(arrays["dof"]), 2)),
        fixed=_integers(path, "fixed", arrays.get("fixed", np.zeros(0, dtype=int)), (-1,)),
        element=None if element is None else _integers(path, "element", element, (-1, -1)),
    )
    known = {
        "node": np.unique(nodes.node).size == count and count > 0,
        "dof": np.isin(nodes.dof[:, 0], nodes.node).all() and _between(nodes.dof[:, 1], 1, 7),
        "fixed": _between(nodes.fixed, 0, len(nodes.dof) - 1),
        "element": nodes.element is None or np.isin(nodes.element, nodes.node).all(),
    }
    for name, right in known.items():
        if not right:
            raise InputError(
                f"{path}: the array {name} refers to what is not there, or twice to one thing; "
                "node numbers, each once, directions 1 to 7, rows of dof and corners among the "
                "nodes are needed, since they say what belongs together. Export the model again."
            )
    return nodes


def _integers(path: Path, name: str, values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    if values.dtype.kind not in "iu" and not np.array_equal(values, np.round(values)):
        raise InputError(
            f"{path}: the array {name} holds {values.dtype}, not whole numbers; these are needed, "
            f"since they count. Write it with numpy.savez(path, {name}=...)."
        )
    return _shaped(path, name, values.astype(np.int64), shape)


def _shaped(path: Path, name: str, values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return an array of a shape, in which -1 is any length."""
    ranks_agree = values.ndim == len(shape)
    if not ranks_agree or any(n not in (-1, m) for n, m in zip(shape, values.shape, strict=True)):
        raise InputError(
            f"{path}: the array {name} has the shape {values.shape}; {shape} is needed (-1: any), "
            f"since its rows are counted. Write it with numpy.savez(path, {name}=...)."
        )
    return values


def _between(values: np.ndarray, low: int, high: int) -> bool:
    return bool(np.all((values >= low) & (values <= high)))


@arguments_checked
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

    Examples
    --------
    >>> bp.io.npz_modes.write("modes.npz", plane).name
    'modes.npz'
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


def _check_misspelt(path: Path, names: list[str], absent: set[str]) -> None:
    """Refuse an array without a name, or of nearly that of an absent one: it would be ignored."""
    if "arr_0" in names:
        raise InputError(
            f"{path} holds an array without a name (arr_0); each needs the name of what it is, "
            "since nothing else says so. Write it with numpy.savez(path, damping_ratio=...)."
        )
    known = {alias: name for name, aliases in _NAMES.items() for alias in aliases}
    for name in set(names) - set(known):
        nearest = difflib.get_close_matches(name.lower(), known, n=1, cutoff=_ALIKE)
        if nearest and known[nearest[0]] in absent:
            raise InputError(
                f"{path} holds an array {name}, which is not known, and none of the name "
                f"{nearest[0]}; a known name is needed, since another array is ignored. Write it "
                f"with numpy.savez(path, {nearest[0]}=...), or leave it out."
            )


def _arrays(path: Path, wanted: Sequence[str], required: Sequence[str]) -> dict[str, np.ndarray]:
    """Arrays of a file by the first of their names, whatever name they have in the file."""
    archive = NpzArchive(path, "nodes and modes")
    aliases = {name: [alias for alias in _NAMES[name] if alias in archive.names] for name in wanted}
    for name in wanted:
        if len(aliases[name]) > 1 or (name in required and not aliases[name]):
            contents = "both " + " and ".join(aliases[name]) if aliases[name] else f"no {name}"
            raise InputError(
                f"{path} holds {contents}, among {', '.join(archive.names)}; one array named "
                f"{' or '.join(_NAMES[name])} is needed, since a model has its {name} once. Write "
                f"it with numpy.savez(path, {name}=..., ...), in SI."
            )
    _check_misspelt(path, archive.names, {name for name, names in aliases.items() if not names})
    arrays = {name: archive.array(names[0]) for name, names in aliases.items() if names}
    for name, values in arrays.items():
        if values.dtype.kind not in "iuf":
            raise InputError(
                f"{path} holds {values.dtype} as {aliases[name][0]}; real numbers are needed, "
                f"since it is the {name} of a model. Write it with numpy.savez(path, {name}=...)."
            )
    check_plausible(path, **arrays)
    return arrays
