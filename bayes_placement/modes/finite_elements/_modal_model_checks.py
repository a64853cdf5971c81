"""Checks of the arrays of a modal model; errors say what is needed."""

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped
from numpy.typing import ArrayLike

from ..._shared.errors import InputError

Nodes = Int[np.ndarray, "node"]
Dof = Int[np.ndarray, "dof 2"]
Shapes = Float[np.ndarray, "row mode"]
PerMode = Float[np.ndarray, "mode"]

_RIGID = 1e-3  # of the first elastic natural frequency
_RIGID_OF_ONE_BODY = 6
_DIRECTIONS = 7
_UNUSUAL_DAMPING = 1.0
_SLOPES = np.array([0, 0, 0, 0, 1, 1, 1, 2])  # order of derivatives in a length, by direction


def checked_position(position: ArrayLike) -> Float[np.ndarray, "node 3"]:
    """Coordinates, three of each node."""
    coordinates = np.asarray(position, dtype=float)
    if coordinates.ndim != 2 or coordinates.shape[1] != 3 or not len(coordinates):
        raise InputError(
            f"position has the shape {coordinates.shape}; [node, 3] is needed, since each node has "
            "the coordinates x, y, z [m]. Give zeros for the axes that a plane structure lacks."
        )
    finite = np.isfinite(coordinates).all(axis=1)
    if not finite.all():
        row = int(np.argmin(finite))
        raise InputError(
            f"position of node {row} (counted from 0) is {coordinates[row]}; finite coordinates "
            "[m] are needed, since sensors are placed among the nodes. Leave out nodes without "
            "coordinates."
        )
    return coordinates


def checked_node(node: ArrayLike | None, count: int) -> Nodes:
    """Node numbers, each once."""
    if node is None:
        return np.arange(1, count + 1)
    numbers = _integers(node, "node")
    if numbers.shape != (count,):
        raise InputError(
            f"node has the shape {numbers.shape}, but position places {count} nodes; one number "
            f"for each is needed, since it distinguishes their shapes. Give node of length {count}."
        )
    unique, times = np.unique(numbers, return_counts=True)
    if (times > 1).any():
        raise InputError(
            f"node holds the number {unique[times > 1][0]} more than once; each number may stand "
            "for one node only, since either position could be meant. Leave the repetition out, "
            "of position and shape too: numpy.unique(node, return_index=True)."
        )
    return numbers


def by_row(shape: ArrayLike, dof: ArrayLike | None, node: Nodes) -> tuple[Shapes, Dof]:
    """Mode shapes by row, and the node and direction of each row."""
    shapes = _real(shape)
    if shapes.ndim == 3 and dof is None:
        return _flat(shapes, node)
    if shapes.ndim != 2 or dof is None:
        also = "without dof" if dof is None else "with dof"
        raise InputError(
            f"shape has the shape {shapes.shape} and came {also}; [node, axis, mode] without dof, "
            "or [dof, mode] with dof is needed, since otherwise the direction in which a row "
            "moves is unknown. Give shape.reshape(node, axis, mode), or dof=[(node, direction), "
            "...] with directions 1 to 6 for x, y, z and the rotations about them."
        )
    return shapes, _integers(dof, "dof")


def _real(shape: ArrayLike) -> Float[np.ndarray, "..."]:
    shapes = np.asarray(shape)
    if np.iscomplexobj(shapes) and not np.any(shapes.imag):
        shapes = shapes.real  # numpy.linalg.eig returns complex numbers, also where all are real
    if np.iscomplexobj(shapes):
        raise InputError(
            "shape is complex; the real normal modes of the undamped structure are needed, since "
            "damping is a separate law. Let the finite element code solve the "
            "undamped eigenproblem."
        )
    return shapes if shapes.dtype in (np.float32, np.float64) else shapes.astype(float)


def _flat(shape: Float[np.ndarray, "..."], node: Nodes) -> tuple[Shapes, Dof]:
    nodes, axes, modes = shape.shape
    if nodes != node.size or axes not in (3, 6):
        raise InputError(
            f"shape has the shape {shape.shape} for {node.size} nodes; [{node.size}, 3 or 6, mode] "
            "is needed, since each node moves along x, y, z and may rotate about them. Give "
            "[dof, mode] and dof=[(node, direction), ...] where only some directions are known."
        )
    directions = np.tile(np.arange(1, axes + 1), nodes)
    dof = np.column_stack([np.repeat(node, axes), directions])
    return shape.reshape(nodes * axes, modes), dof


def check_shape(shape: Shapes) -> None:
    """Refuse shapes without modes, with gaps, or of zeros, without a copy of them."""
    if not shape.size:
        raise InputError(
            f"shape has the shape {shape.shape}; at least one mode at one node is needed, since "
            "the response is a sum over modes. Export the modes with the nodes."
        )
    largest = np.maximum(shape.max(axis=0), -shape.min(axis=0))  # NaN and infinity get through
    _refuse_modes(~np.isfinite(largest), "holds values that are not finite", "a gap or overflow")
    _refuse_modes(largest == 0, "is zero at every node", "a mode without motion")


def _refuse_modes(wrong: Bool[np.ndarray, "mode"], defect: str, cause: str) -> None:
    if wrong.any():
        modes = ", ".join(map(str, np.flatnonzero(wrong)[:5] + 1))
        raise InputError(
            f"shape {defect} in mode {modes} (counted from 1); finite shapes that move somewhere "
            f"are needed, since {cause} would spread to every response. Leave the mode out, or "
            "export it again."
        )


def checked_dof(dof: Int[np.ndarray, "..."], node: Nodes, rows: int) -> Dof:
    """Rows of node and direction, each once, of known nodes."""
    if dof.shape != (rows, 2):
        raise InputError(
            f"dof has the shape {dof.shape}, but shape has {rows} rows; [{rows}, 2] is needed, one "
            "(node, direction) for each row of shape. A wrong number of degrees of freedom usually "
            "means that fixed or dependent ones are left out of one of the two: leave them out "
            "of the other too."
        )
    _check_directions(dof)
    check_known(dof[:, 0], node)
    rank = np.searchsorted(np.sort(node), dof[:, 0]) * (_DIRECTIONS + 1) + dof[:, 1]
    first = np.unique(rank, return_index=True)[1]
    if first.size < rows:
        repeated = dof[np.setdiff1d(np.arange(rows), first)[0]]
        raise InputError(
            f"dof holds node {repeated[0]}, direction {repeated[1]} more than once; each row must "
            "be another degree of freedom, since either could be meant. Leave the repetition out."
        )
    return dof


def _check_directions(dof: Dof) -> None:
    wrong = (dof[:, 1] < 1) | (dof[:, 1] > _DIRECTIONS)
    if wrong.any():
        node, direction = dof[wrong][0]
        raise InputError(
            f"dof holds direction {direction} of node {node}; 1 to 6 (x, y, z and the rotations "
            "about them) or 7 (the twist of a plate) is needed, since rows are "
            "read so. Add 1 where directions are counted from 0."
        )


def checked_unit(unit: float, name: str) -> float:
    """A unit in SI."""
    if not 0 < unit < np.inf:
        raise InputError(
            f"{name} is {unit:g}; a positive number is needed, one unit of the arrays in "
            "SI. In mm, t, N and s, length_unit=1e-3 and mass_unit=1e3."
        )
    return float(unit)


def check_known(wanted: Int[np.ndarray, "wanted"], node: Nodes) -> None:
    """Refuse numbers of nodes that are not in the model."""
    unknown = wanted[~np.isin(wanted, node)]
    if unknown.size:
        numbers = ", ".join(map(str, np.unique(unknown)[:5]))
        raise InputError(
            f"Node {numbers} is not among the {node.size} nodes of the model, numbered "
            f"{node.min()} to {node.max()}; known nodes are needed, since the others have no "
            "coordinates. Give these with the others, or leave the numbers out."
        )


def checked_frequency(frequency: ArrayLike, modes: int) -> PerMode:
    """Natural frequencies in ascending order, one for each shape."""
    values = _per_mode(frequency, modes, "natural_frequency", "Hz")
    descending = np.diff(values, prepend=0.0) < 0
    if descending.any():
        mode = int(np.flatnonzero(descending)[0])
        raise InputError(
            f"natural_frequency of mode {mode + 1} is {values[mode]:g} Hz; numbers from 0 in "
            "ascending order are needed, since the lowest modes are kept and rigid-body modes "
            "come first. Give 0 for rigid-body modes, and sort: order = "
            "numpy.argsort(natural_frequency), shape[..., order]."
        )
    return values


def without_rigid_residue(frequency: PerMode) -> PerMode:
    """Set the frequencies of rigid-body modes, zero but for rounding, to exactly 0."""
    last = min(_RIGID_OF_ONE_BODY, frequency.size - 1)
    gaps = [k for k in range(1, last + 1) if frequency[k - 1] < _RIGID * frequency[k]]
    return np.where(np.arange(frequency.size) < max(gaps, default=0), 0.0, frequency)


def checked_mass(mass: ArrayLike | float | int | None, modes: int) -> PerMode:
    """Modal masses, one for each shape."""
    if mass is None:
        raise InputError(
            f"{modes} mode shapes came without modal masses; they are needed, since the "
            "scale of a shape is arbitrary and receptance is shape x shape / modal mass. Give "
            "modal_mass=[...] [kg], or modal_mass=1 if the shapes are mass-normalised; where "
            "they are unknown, give modal_mass=1 and a distribution for each to "
            "finite_elements.UnknownModes."
        )
    values = np.asarray(mass, dtype=float)
    values = values if values.ndim else np.full(modes, values)
    values = _per_mode(values, modes, "modal_mass", "kg")
    if (values <= 0).any():
        mode = int(np.flatnonzero(values <= 0)[0])
        raise InputError(
            f"modal_mass of mode {mode + 1} is {values[mode]:g} kg; positive ones are needed, "
            "since shapes are divided by their roots. Files often hold 0 where the modal mass is "
            "not known: give modal_mass=[...], or modal_mass=1 if the shapes are mass-normalised."
        )
    return values


def checked_damping(damping: ArrayLike | None, modes: int) -> PerMode | None:
    """Modal damping ratios, one for each shape."""
    if damping is None:
        return None
    values = _per_mode(damping, modes, "damping_ratio", "1")
    wrong = (values < 0) | (values >= _UNUSUAL_DAMPING)
    if wrong.any():
        mode = int(np.flatnonzero(wrong)[0])
        raise InputError(
            f"damping_ratio of mode {mode + 1} is {values[mode]:g}; a number from 0 to below 1 is "
            "needed, the share of critical damping. Divide per cent by 100 and loss factors by 2."
        )
    return values


def normalised(
    shape: Shapes, direction: Int[np.ndarray, "row"], mass: PerMode, length_unit: float
) -> Shapes:
    """Divide by the roots of the modal masses [kg], and slopes by the unit of length [m]."""
    if (mass == 1).all() and length_unit == 1:
        return shape
    scaled = shape / np.sqrt(mass).astype(shape.dtype)
    if length_unit != 1:
        scaled /= (length_unit ** _SLOPES[direction])[:, None].astype(shape.dtype)
    return scaled


def _per_mode(values: ArrayLike, modes: int, name: str, unit: str) -> PerMode:
    array = np.asarray(values, dtype=float)
    if array.shape != (modes,) or not np.isfinite(array).all():
        defect = f"the shape {array.shape}" if array.shape != (modes,) else "gaps (NaN or infinity)"
        raise InputError(
            f"{name} has {defect}; one finite number [{unit}] for each of the {modes} modes of "
            f"shape is needed, since they belong together. Give {name} of length {modes}."
        )
    return array


def _integers(values: ArrayLike, name: str) -> Int[np.ndarray, "..."]:
    array: Shaped[np.ndarray, "..."] = np.asarray(values)
    if array.dtype.kind in "iu":
        return array.astype(np.int64, copy=False)
    if array.dtype.kind != "f" or not (array == np.round(array)).all():
        raise InputError(
            f"{name} holds {array.dtype.name} values; whole numbers are needed, since nodes and "
            f"directions are counted. Give {name} as integers."
        )
    return array.astype(np.int64)
