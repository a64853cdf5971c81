"""_modal_model_checks: in, arrays as given; out, the same of exact type and size, or an error.

Not known here: files, damping laws, probability.
"""

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped
from numpy.typing import ArrayLike

from ..._types import InputError

_RIGID = 1e-3  # of the first elastic natural frequency
_RIGID_OF_ONE_BODY = 6
_DIRECTIONS = 7
_UNUSUAL_DAMPING = 1.0
_SLOPES = np.array([0, 0, 0, 0, 1, 1, 1, 2])  # how often a direction differentiates by a length


def checked_position(position: ArrayLike) -> Float[np.ndarray, "node 3"]:
    """Coordinates, three of each node."""
    given = np.asarray(position, dtype=float)
    if given.ndim != 2 or given.shape[1] != 3 or not len(given):
        raise InputError(
            f"position has the shape {given.shape}; [node, 3] is needed, since each node has the "
            "coordinates x, y, z [m]. Give zeros for the axes that a plane structure lacks."
        )
    if not np.isfinite(given).all():
        row = int(np.flatnonzero(~np.isfinite(given).all(axis=1))[0])
        raise InputError(
            f"position of node {row} (counted from 0) is {given[row]}; finite coordinates [m] are "
            "needed, since sensors are placed among the nodes. Leave out nodes without a place."
        )
    return given


def checked_node(node: ArrayLike | None, count: int) -> Int[np.ndarray, "node"]:
    """Node numbers, each once."""
    if node is None:
        return np.arange(1, count + 1)
    given = _whole_numbers(node, "node")
    if given.shape != (count,):
        raise InputError(
            f"node has the shape {given.shape}, but position places {count} nodes; one number for "
            f"each is needed, since shapes are told apart by it. Give node of length {count}."
        )
    numbers, times = np.unique(given, return_counts=True)
    if (times > 1).any():
        raise InputError(
            f"node holds the number {numbers[times > 1][0]} more than once; each number may stand "
            "for one node only, since either place could be meant. Leave the repetition out, of "
            "position and shape too: numpy.unique(node, return_index=True)."
        )
    return given


def by_row(
    shape: ArrayLike, dof: ArrayLike | None, node: Int[np.ndarray, "node"]
) -> tuple[Float[np.ndarray, "row mode"], Int[np.ndarray, "dof 2"]]:
    """Mode shapes by row, and what each row is."""
    given = _real(shape)
    if given.ndim == 3 and dof is None:
        return _flat(given, node)
    if given.ndim != 2 or dof is None:
        also = "without dof" if dof is None else "with dof"
        raise InputError(
            f"shape has the shape {given.shape} and came {also}; [node, axis, mode] without dof, "
            "or [dof, mode] with dof is needed, since otherwise nobody knows in which direction a "
            "row moves. Give shape.reshape(node, axis, mode), or dof=[(node, direction), ...] with "
            "directions 1 to 6 for x, y, z and the rotations about them."
        )
    return given, _whole_numbers(dof, "dof")


def _real(shape: ArrayLike) -> Float[np.ndarray, "..."]:
    given = np.asarray(shape)
    if np.iscomplexobj(given):
        raise InputError(
            "shape is complex; the real normal modes of the undamped structure are needed, since "
            "damping is added to them as a law of its own. Let the finite element code solve the "
            "undamped eigenproblem."
        )
    return given if given.dtype in (np.float32, np.float64) else given.astype(float)


def _flat(
    shape: Float[np.ndarray, "..."], node: Int[np.ndarray, "node"]
) -> tuple[Float[np.ndarray, "row mode"], Int[np.ndarray, "dof 2"]]:
    nodes, axes, modes = shape.shape
    if nodes != node.size or axes not in (3, 6):
        raise InputError(
            f"shape has the shape {shape.shape} for {node.size} nodes; [{node.size}, 3 or 6, mode] "
            "is needed, since each node moves along x, y, z and perhaps turns about them. Give "
            "[dof, mode] and dof=[(node, direction), ...] where only some directions are known."
        )
    directions = np.tile(np.arange(1, axes + 1), nodes)
    dof = np.column_stack([np.repeat(node, axes), directions])
    return shape.reshape(nodes * axes, modes), dof


def check_shape(shape: Float[np.ndarray, "row mode"]) -> None:
    """Refuse shapes without modes, with gaps, or of zeros, without a copy of them."""
    if not shape.size:
        raise InputError(
            f"shape has the shape {shape.shape}; at least one mode at one node is needed, since "
            "the response is a sum over modes. Export the modes with the nodes."
        )
    largest = np.maximum(shape.max(axis=0), -shape.min(axis=0))  # NaN and infinity get through
    _refuse_mode(~np.isfinite(largest), "holds values that are not finite", "a gap or an overflow")
    _refuse_mode(largest == 0, "is zero at every node", "a mode that nothing shows")


def _refuse_mode(wrong: Bool[np.ndarray, "mode"], what: str, because: str) -> None:
    if wrong.any():
        modes = ", ".join(map(str, np.flatnonzero(wrong)[:5] + 1))
        raise InputError(
            f"shape {what} in mode {modes} (counted from 1); finite shapes that move somewhere are "
            f"needed, since {because} would spread to every response. Leave the mode out, or "
            "export it again."
        )


def checked_dof(
    dof: Int[np.ndarray, "..."], node: Int[np.ndarray, "node"], rows: int
) -> Int[np.ndarray, "dof 2"]:
    """Rows of node and direction, each once, of nodes that are placed."""
    if dof.shape != (rows, 2):
        raise InputError(
            f"dof has the shape {dof.shape}, but shape has {rows} rows; [{rows}, 2] is needed, one "
            "(node, direction) for each row of shape. A wrong number of degrees of freedom usually "
            "means that fixed or dependent ones are left out of one of both: leave them out of "
            "the other too."
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


def _check_directions(dof: Int[np.ndarray, "dof 2"]) -> None:
    wrong = (dof[:, 1] < 1) | (dof[:, 1] > _DIRECTIONS)
    if wrong.any():
        node, direction = dof[wrong][0]
        raise InputError(
            f"dof holds direction {direction} of node {node}; 1 to 6 (x, y, z and the rotations "
            "about them) or 7 (the twist of a plate) is needed, since that is how a row is "
            "read. Add 1 where directions are counted from 0."
        )


def checked_unit(unit: float, name: str) -> float:
    """A unit in SI."""
    if not 0 < unit < np.inf:
        raise InputError(
            f"{name} is {unit:g}; a positive number is needed, what one unit of the arrays is in "
            "SI. In mm, t, N and s, length_unit=1e-3 and mass_unit=1e3."
        )
    return float(unit)


def check_known(wanted: Int[np.ndarray, "wanted"], node: Int[np.ndarray, "node"]) -> None:
    """Refuse numbers of nodes that are not in the model."""
    strange = wanted[~np.isin(wanted, node)]
    if strange.size:
        numbers = ", ".join(map(str, np.unique(strange)[:5]))
        raise InputError(
            f"Node {numbers} is not among the {node.size} nodes of the model, numbered "
            f"{node.min()} to {node.max()}; known nodes are needed, since the others have no "
            "place. Give their coordinates with the others, or leave these numbers out."
        )


def checked_frequency(frequency: ArrayLike, modes: int) -> Float[np.ndarray, "mode"]:
    """Natural frequencies in ascending order, one of each shape."""
    given = _one_each(frequency, modes, "natural_frequency", "Hz")
    if (np.diff(given, prepend=0.0) < 0).any():
        place = int(np.flatnonzero(np.diff(given, prepend=0.0) < 0)[0])
        raise InputError(
            f"natural_frequency of mode {place + 1} is {given[place]:g} Hz; numbers from 0 in "
            "ascending order are needed, since the lowest modes are kept and rigid-body modes "
            "come first. Give 0 for rigid-body modes, and sort: order = "
            "numpy.argsort(natural_frequency), shape[..., order]."
        )
    return given


def without_rigid_residue(frequency: Float[np.ndarray, "mode"]) -> Float[np.ndarray, "mode"]:
    """Set the rounding residue of rigid-body modes to exactly 0."""
    last = min(_RIGID_OF_ONE_BODY, frequency.size - 1)
    gaps = [k for k in range(1, last + 1) if frequency[k - 1] < _RIGID * frequency[k]]
    return np.where(np.arange(frequency.size) < max(gaps, default=0), 0.0, frequency)


def checked_mass(mass: ArrayLike | float | int | None, modes: int) -> Float[np.ndarray, "mode"]:
    """Modal masses, one of each shape."""
    if mass is None:
        raise InputError(
            f"{modes} mode shapes came without modal masses; they are needed, since a shape "
            "has no scale of its own and receptance is shape x shape / modal mass. Give "
            "modal_mass=[...] [kg], or modal_mass=1 if the shapes are mass-normalised; where "
            "nobody knows them, give modal_mass=1 and let nodal_modes.UnknownModes "
            "hold a distribution for each."
        )
    given = np.asarray(mass, dtype=float)
    given = _one_each(np.full(modes, given) if not given.ndim else given, modes, "modal_mass", "kg")
    if (given <= 0).any():
        mode = int(np.flatnonzero(given <= 0)[0])
        raise InputError(
            f"modal_mass of mode {mode + 1} is {given[mode]:g} kg; positive ones are needed, since "
            "shapes are divided by their roots. Files often hold 0 where the modal mass is not "
            "known: give modal_mass=[...], or modal_mass=1 if the shapes are mass-normalised."
        )
    return given


def checked_damping(damping: ArrayLike | None, modes: int) -> Float[np.ndarray, "mode"] | None:
    """Modal damping ratios, one of each shape."""
    if damping is None:
        return None
    given = _one_each(damping, modes, "damping_ratio", "1")
    wrong = (given < 0) | (given >= _UNUSUAL_DAMPING)
    if wrong.any():
        mode = int(np.flatnonzero(wrong)[0])
        raise InputError(
            f"damping_ratio of mode {mode + 1} is {given[mode]:g}; a number from 0 to below 1 is "
            "needed, the share of critical damping. Divide per cent by 100 and loss factors by 2."
        )
    return given


def normalised(
    shape: Float[np.ndarray, "row mode"],
    direction: Int[np.ndarray, "row"],
    mass: Float[np.ndarray, "mode"],
    length_unit: float,
) -> Float[np.ndarray, "row mode"]:
    """Divide by the roots of the modal masses [kg], and slopes by the unit of length [m]."""
    if (mass == 1).all() and length_unit == 1:
        return shape
    scaled = shape / np.sqrt(mass).astype(shape.dtype)
    if length_unit != 1:
        scaled /= (length_unit ** _SLOPES[direction])[:, None].astype(shape.dtype)
    return scaled


def _one_each(values: ArrayLike, modes: int, name: str, unit: str) -> Float[np.ndarray, "mode"]:
    given = np.asarray(values, dtype=float)
    if given.shape != (modes,) or not np.isfinite(given).all():
        holds = f"the shape {given.shape}" if given.shape != (modes,) else "gaps (NaN or infinity)"
        raise InputError(
            f"{name} has {holds}; one finite number [{unit}] for each of the {modes} modes of "
            f"shape is needed, since they belong together. Give {name} of length {modes}."
        )
    return given


def _whole_numbers(values: ArrayLike, name: str) -> Int[np.ndarray, "..."]:
    given: Shaped[np.ndarray, "..."] = np.asarray(values)
    if given.dtype.kind in "iu":
        return given.astype(np.int64, copy=False)
    if given.dtype.kind != "f" or not (given == np.round(given)).all():
        raise InputError(
            f"{name} holds {given.dtype.name} values; whole numbers are needed, since nodes and "
            f"directions are counted. Give {name} as integers."
        )
    return given.astype(np.int64)
