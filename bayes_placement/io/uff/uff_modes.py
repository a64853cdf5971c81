"""uff_modes: in, a universal file (datasets 15, 55, 164, 2411); out, a modal model in SI.

Not known here: FRFs, structures, probability.
"""

from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...modes.finite_elements.modal_model import ModalModel
from ._blocks import DATA_AT_NODES, Block, MeasurementFileError, load
from ._nodes import node_positions
from ._units import FileUnits, file_units

__all__ = ["MeasurementFileError", "read"]

_NORMAL_MODE, _DISPLACEMENT, _REAL = 2, 8, 2
_VALUES = {2: 3, 3: 6}  # values of a node, by data characteristic: translations, rotations too
_ANALYSIS = {
    1: "static",
    2: "normal mode",
    3: "complex mode",
    4: "transient",
    5: "frequency response",
    6: "buckling",
    7: "complex mode",
}
_KIND = {
    2: "stress",
    3: "strain",
    8: "displacement",
    9: "reaction",
    11: "velocity",
    12: "acceleration",
}


class _Mode(NamedTuple):
    """One mode of the file, in its units."""

    place: str
    load_case: int
    number: int
    frequency: float
    mass: float
    damping: float
    node: np.ndarray
    value: np.ndarray  # [node, axis]


def read(path: str | Path, *, modal_mass: ArrayLike | float | int | None = None) -> ModalModel:
    """Read nodes and real normal modes of a universal file (UFF), in SI.

    Nodes come from dataset 15 or 2411, modes from dataset 55 (analysis type 2, displacements),
    with natural frequency, modal mass and viscous damping ratio; stresses and other results are
    passed over, as are hysteretic damping and dataset 2414. Units are those of dataset 164 with
    the second for time, else SI. Modes come in ascending order, nodes in that of their numbers;
    a node without a record in one mode has zeros there, as the format says, and nodes without
    any are left out, as are directions in which nothing moves. The format holds six digits.

    Parameters
    ----------
    path
        The file.
    modal_mass
        Modal masses in the unit of the file, in ascending order of the natural frequencies, where
        the file holds none or wrong ones; 1 if the shapes are mass-normalised.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    MeasurementFileError
        (A ValueError.) If the file is malformed or its modes contradict each other.
    ValueError
        If modal masses are missing, or the arrays do not make a modal model.
    """
    blocks = load(Path(path), DATA_AT_NODES)
    modes = sorted(_normal_modes(blocks, Path(path)), key=lambda mode: mode.frequency)
    _check_one_set(modes)
    units = file_units(blocks)
    node = np.unique(np.concatenate([mode.node for mode in modes]))
    damping = np.array([mode.damping for mode in modes])
    model = ModalModel.from_arrays(
        node=node,
        position=_positions(blocks, node),
        shape=_shapes(modes, node),
        natural_frequency=[mode.frequency for mode in modes],
        modal_mass=[mode.mass for mode in modes] if modal_mass is None else modal_mass,
        damping_ratio=damping if damping.any() else None,
        length_unit=units.length,
        mass_unit=units.force / units.length,
    )
    return model.without_unused_directions()


def _normal_modes(blocks: list[Block], path: Path) -> list[_Mode]:
    results = [block for block in blocks if block.dataset == DATA_AT_NODES]
    modes = [block for block in results if _is_normal_mode(block)]
    if not modes:
        found = ", ".join(sorted({_described(block) for block in results}))
        raise MeasurementFileError(
            f"{path} holds {found or 'no data at nodes (dataset 55)'}; real normal modes of "
            "displacements (analysis type 2, data type 8) are needed, since receptance is a sum "
            "over them. Export the undamped modes as dataset 55 (2414 is not read), as "
            "displacements and real numbers."
        )
    return [_mode(block) for block in modes]


def _is_normal_mode(block: Block) -> bool:
    fields = block.fields
    kind = (fields["analysis_type"], fields["spec_data_type"], fields["data_type"])
    return kind == (_NORMAL_MODE, _DISPLACEMENT, _REAL)


def _described(block: Block) -> str:
    fields = block.fields
    analysis, kind = fields["analysis_type"], fields["spec_data_type"]
    number = "real" if fields["data_type"] == _REAL else "complex"
    return (
        f"{_ANALYSIS.get(analysis, f'analysis type {analysis}')} of {number} "
        f"{_KIND.get(kind, f'data type {kind}')}"
    )


def _mode(block: Block) -> _Mode:
    fields = block.fields
    return _Mode(
        block.place,
        load_case=fields["load_case"],
        number=fields["mode_n"],
        frequency=fields["freq"],
        mass=fields["modal_m"],
        damping=fields["modal_damp_vis"],
        node=_nodes(block),
        value=_values(block),
    )


def _nodes(block: Block) -> np.ndarray:
    numbers = np.asarray(block.fields["node_nums"], dtype=np.int64)
    if not numbers.size or np.unique(numbers).size < numbers.size:
        found = "no node" if not numbers.size else "a node more than once"
        raise MeasurementFileError(
            f"{block.place} holds {found}; each node with its displacement once is needed, since "
            "either could be meant. Export the mode again."
        )
    return numbers


def _values(block: Block) -> np.ndarray:
    """Displacements of each node; pyuff takes any other count than 3 for 6, and never counts."""
    fields = block.fields
    kind, each = fields["data_ch"], fields["n_data_per_node"]
    columns = [np.asarray(fields[f"r{axis + 1}"]) for axis in range(6 if each != 3 else 3)]
    right = all(len(column) == len(fields["node_nums"]) for column in columns)
    if _VALUES.get(kind) != each or not right:
        raise MeasurementFileError(
            f"{block.place} announces data characteristic {kind} with {each} values of each node "
            f"and holds {sum(map(len, columns))} values for {len(fields['node_nums'])} nodes; "
            "three translations (2) or these and three rotations (3) of each node are needed, "
            "since directions are told by them. Export the mode as displacement vectors."
        )
    return np.column_stack(columns)


def _check_one_set(modes: list[_Mode]) -> None:
    """Refuse modes of several solutions, which would count twice."""
    first = modes[0]
    for earlier, later in pairwise(modes):
        repeated = (earlier.number, earlier.frequency) == (later.number, later.frequency)
        mixed = later.load_case != first.load_case or later.value.shape[1] != first.value.shape[1]
        if repeated or mixed:
            raise MeasurementFileError(
                f"{later.place} holds mode {later.number} of load case {later.load_case} at "
                f"{later.frequency:g} Hz with {later.value.shape[1]} values of each node, and "
                f"{(earlier if repeated else first).place} belongs to another solution or is the "
                "same mode; the modes of one solution are needed, each once, since every mode "
                "adds to the response. Export one load case into a file of its own."
            )


def _positions(blocks: list[Block], node: np.ndarray) -> np.ndarray:
    """Coordinates of the nodes in the unit of the file."""
    points = node_positions(blocks, FileUnits(), set(node.tolist()))
    missing = [number for number in node.tolist() if number not in points]
    if missing:
        shown = ", ".join(map(str, missing[:5]))
        raise MeasurementFileError(
            f"The modes move {len(missing)} nodes that datasets 15 and 2411 do not place ({shown}"
            f"{', ...' if len(missing) > 5 else ''}); coordinates of all of them are needed, since "
            "sensors are placed among them. Export the geometry with the modes."
        )
    return np.array([points[number] for number in node.tolist()])


def _shapes(modes: list[_Mode], node: np.ndarray) -> np.ndarray:
    shape = np.zeros((node.size, modes[0].value.shape[1], len(modes)))
    for column, mode in enumerate(modes):
        shape[np.searchsorted(node, mode.node), :, column] = mode.value
    return shape
