"""Modes of a universal file: normal ones (dataset 55) as a modal model in SI, and measured ones."""

import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..._shared.arguments import arguments_checked
from ...modes.finite_elements.modal_model import ModalModel
from ...positions.channel import Channel
from .._gate import check_plausible, reading
from ._datasets import (
    DATA_AT_NODES,
    FUNCTION,
    Dataset,
    MeasurementFileError,
    blocks_of,
    described,
    load,
)
from ._decode import COMPLEX, NORMAL, Fields
from ._mesh import node_positions
from ._units import file_units, of_nodes

_NORMAL_MODE, _DISPLACEMENT, _REAL = 2, 8, 2
_VALUES = {2: 3, 3: 6}  # values of a node by data characteristic; 6 with rotations
_ANALYSIS_TYPES = {
    1: "static",
    2: "normal mode",
    3: "complex mode",
    4: "transient",
    5: "frequency response",
    6: "buckling",
    7: "complex mode",
}
_DATA_TYPES = {
    2: "stress",
    3: "strain",
    8: "displacement",
    9: "reaction",
    11: "velocity",
    12: "acceleration",
}


class _Mode(NamedTuple):
    """A mode of the file, in the units of the file."""

    place: str
    fields: Fields
    node: np.ndarray
    value: np.ndarray  # [node, axis]


@arguments_checked
def read(
    path: str | Path,
    *,
    modal_mass: ArrayLike | float | int | None = None,
    length_unit: float | int | None = None,
    mass_unit: float | int | None = None,
) -> ModalModel:
    """Read nodes and real normal modes of a universal file (UFF), in SI.

    Nodes come from dataset 15 or 2411, modes from dataset 55 (analysis type 2, displacements),
    with natural frequency, modal mass and viscous damping ratio; stresses and other results,
    hysteretic damping and dataset 2414 are ignored. Units are those of dataset 164 with the
    second for time, else `length_unit` and `mass_unit`. Modes are sorted by frequency, nodes by
    number. A node without a record in a mode has zeros there, as the format says; nodes without any
    record are left out, and so are directions in which nothing moves. The format holds six digits.

    Parameters
    ----------
    path
        The file.
    modal_mass
        Modal masses in the unit of the file, in ascending order of the natural frequencies, where
        the file holds none or wrong ones; 1 if the shapes are mass-normalised.
    length_unit, mass_unit
        What one unit of length and of mass is in m and kg, where no dataset 164 says it: 1e-3 and
        1e3 for mm, t and s. Without any of these the file is taken for SI, with a warning.

    Returns
    -------
    ModalModel
        Nodes and modes in SI.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    MeasurementFileError
        (A ValueError.) If the file is malformed or its modes contradict each other.
    ValueError
        If modal masses are missing, or the arrays do not make a modal model.

    Examples
    --------
    >>> model = bp.io.uff.read_modes("modes.unv", modal_mass=1.0)  # doctest: +SKIP
    """
    with reading(Path(path), "normal modes of a universal file", "Export it again."):
        return _model(Path(path), modal_mass, length_unit=length_unit, mass_unit=mass_unit)


def _model(
    path: Path, modal_mass: ArrayLike | float | int | None, **stated: float | int | None
) -> ModalModel:
    datasets = load(path, DATA_AT_NODES)
    modes = sorted(_normal_modes(datasets, path), key=lambda mode: mode.fields["freq"])
    _check_single_solution(modes)
    node = np.unique(np.concatenate([mode.node for mode in modes]))
    damping = np.array([mode.fields["modal_damp_vis"] for mode in modes])
    position = _positions(datasets, node)
    units = of_nodes(path, file_units(datasets), position, **stated)
    model = ModalModel.from_arrays(
        node=node,
        position=position,
        shape=_shapes(modes, node),
        natural_frequency=[mode.fields["freq"] for mode in modes],
        modal_mass=(
            [mode.fields["modal_m"] for mode in modes] if modal_mass is None else modal_mass
        ),
        damping_ratio=damping if damping.any() else None,
        length_unit=units.length,
        mass_unit=units.force / units.length,
    )
    check_plausible(path, coordinates=model.position, shapes=model.shape)
    return model.without_unused_directions()


def _normal_modes(datasets: list[Dataset], path: Path) -> list[_Mode]:
    results = [dataset for dataset in datasets if dataset.number == DATA_AT_NODES]
    modes = [dataset for dataset in results if _is_normal_mode(dataset)]
    if not modes:
        contents = ", ".join(sorted({_described(dataset) for dataset in results}))
        raise MeasurementFileError(
            f"{path} {f'holds {contents}' if contents else described(path)}; real normal modes of "
            "displacements (analysis type 2, data type 8) are needed, since receptance is a sum "
            "over them. Export the undamped modes as dataset 55 (2414 is not read), as "
            "displacements and real numbers."
        )
    return [_Mode(one.place, one.fields, _nodes(one), _values(one)) for one in modes]


def _is_normal_mode(dataset: Dataset) -> bool:
    fields = dataset.fields
    types = (fields["analysis_type"], fields["spec_data_type"], fields["data_type"])
    return types == (_NORMAL_MODE, _DISPLACEMENT, _REAL)


def _described(dataset: Dataset) -> str:
    fields = dataset.fields
    analysis, data_type = fields["analysis_type"], fields["spec_data_type"]
    number = "real" if fields["data_type"] == _REAL else "complex"
    return (
        f"{_ANALYSIS_TYPES.get(analysis, f'analysis type {analysis}')} of {number} "
        f"{_DATA_TYPES.get(data_type, f'data type {data_type}')}"
    )


def _nodes(dataset: Dataset) -> np.ndarray:
    numbers = np.asarray(dataset.fields["node_nums"], dtype=np.int64)
    if not numbers.size or np.unique(numbers).size < numbers.size:
        contents = "no node" if not numbers.size else "a node more than once"
        raise MeasurementFileError(
            f"{dataset.place} holds {contents}; each node with its displacement once is needed, "
            "since either could be meant. Export the mode again."
        )
    return numbers


def _values(dataset: Dataset) -> np.ndarray:
    """Displacements of each node."""
    fields = dataset.fields
    characteristic, count = fields["data_ch"], fields["n_data_per_node"]
    columns = [np.asarray(fields[f"r{axis + 1}"]) for axis in range(count)]
    if _VALUES.get(characteristic) != count:
        raise MeasurementFileError(
            f"{dataset.place} announces data characteristic {characteristic} with {count} values "
            "of each node; three translations (2) or these and three rotations (3) of each node "
            "are needed, since they say which direction is which. Export the mode as displacement "
            "vectors."
        )
    return np.column_stack(columns)


def _check_single_solution(modes: list[_Mode]) -> None:
    """Refuse modes of more than one solution, which would count twice."""
    first = modes[0]
    for earlier, later in pairwise(modes):
        number, frequency = (later.fields[key] for key in ("mode_n", "freq"))
        load_case, count = later.fields["load_case"], later.value.shape[1]
        repeated = (earlier.fields["mode_n"], earlier.fields["freq"]) == (number, frequency)
        mixed = load_case != first.fields["load_case"] or count != first.value.shape[1]
        if repeated or mixed:
            raise MeasurementFileError(
                f"{later.place} holds mode {number} of load case {load_case} at "
                f"{frequency:g} Hz with {count} values of each node, and "
                f"{(earlier if repeated else first).place} belongs to another solution or is the "
                "same mode; the modes of one solution are needed, each once, since every mode "
                "adds to the response. Export one load case into a file of its own."
            )


def _positions(datasets: list[Dataset], node: np.ndarray) -> np.ndarray:
    """Coordinates of the nodes in the unit of the file."""
    positions = node_positions(datasets, set(node.tolist()))
    missing = [number for number in node.tolist() if number not in positions]
    if missing:
        shown = ", ".join(map(str, missing[:5]))
        raise MeasurementFileError(
            f"The modes move {len(missing)} nodes of which datasets 15 and 2411 give no "
            f"coordinates ({shown}{', ...' if len(missing) > 5 else ''}); those of all are needed, "
            "since sensors are placed among them. Export the geometry with the modes."
        )
    return np.array([positions[number] for number in node.tolist()])


def _shapes(modes: list[_Mode], node: np.ndarray) -> np.ndarray:
    kind = np.result_type(*(mode.value for mode in modes))
    shape = np.zeros((node.size, modes[0].value.shape[1], len(modes)), kind)
    for column, mode in enumerate(modes):
        shape[np.searchsorted(node, mode.node), :, column] = mode.value
    return shape


ALIKE = 1e-2
"""Relative difference of numbers that are one; those that are told apart differ by 2 pi."""

_MOTIONS = (8, 11, 12)  # displacement, velocity, acceleration: the same shape at one frequency

Arguments: TypeAlias = dict[str, Any]
"""Arguments of `ModalParameters`, by name."""


def holds_modes_alone(path: Path) -> bool:
    """Whether a universal file has data at nodes (dataset 55) and no functions (58)."""
    kinds = {block.number for block in blocks_of(path)}
    return DATA_AT_NODES in kinds and FUNCTION not in kinds


def load_measured(path: Path, names: Mapping[int, str], poles: str | None = None) -> Arguments:
    """Read the modes of a universal file as arguments of `ModalParameters`, without deviations.

    Sensors are named by the number of the node; poles of complex modes are in `rad/s` or `Hz`.
    """
    datasets = [entry for entry in load(path, DATA_AT_NODES) if entry.number == DATA_AT_NODES]
    modes = [dataset for dataset in datasets if _is_mode(dataset)]
    if not modes:
        raise MeasurementFileError(
            f"{path} holds {len(datasets)} datasets 55 and no mode among them; normal modes "
            "(analysis type 2) or complex modes (3 or 7) of displacement, velocity or acceleration "
            "are needed. Export the identified modes as dataset 55."
        )
    scale = _scale([one for one in modes if one.fields["analysis_type"] in COMPLEX], poles)
    frequency, damping = np.array([_pole(dataset, scale) for dataset in modes]).T
    order = np.argsort(frequency)
    moved = [_Mode(one.place, one.fields, _nodes(one), _translations(one)) for one in modes]
    nodes = np.unique(np.concatenate([mode.node for mode in moved]))
    shapes = _shapes(moved, nodes)[..., order]
    moving = np.argwhere(np.any(shapes, axis=-1))
    damping = damping[order]
    return {
        "natural_frequency": frequency[order],
        "natural_frequency_deviation": None,
        "damping_ratio": np.where(damping == 0, np.nan, damping) if damping.any() else None,
        "damping_ratio_deviation": None,
        "shape": shapes[moving[:, 0], moving[:, 1]],
        "shape_deviation": None,
        "sensors": tuple(
            Channel(names.get(int(nodes[node]), str(nodes[node])), int(axis) + 1)
            for node, axis in moving
        ),
    }


def _is_mode(dataset: Dataset) -> bool:
    fields = dataset.fields
    analysis, motion = fields["analysis_type"], fields["spec_data_type"]
    return analysis in (NORMAL, *COMPLEX) and motion in _MOTIONS


def _scale(modes: list[Dataset], unit: str | None) -> float:
    """Factor of the poles of complex modes to Hz, negative where their decay is positive."""
    if not modes:
        return 1.0
    eigenvalues = np.array([dataset.fields["eig"] for dataset in modes])
    grows = eigenvalues.real > 0
    wrong = (eigenvalues == 0) | (grows & ~np.all(grows))
    if np.any(wrong):
        number = int(np.argmax(wrong))
        raise MeasurementFileError(
            f"{modes[number].place} holds the eigenvalue {eigenvalues[number]:.6g}; a pole with a "
            "negative real part is needed, since frequency and damping are read from it and a "
            "structure loses energy. Leave modes without such a pole out of the export."
        )
    unit = unit or _unit_by_modal_a(modes, eigenvalues)
    if unit is None and np.all(grows):
        shown = ", ".join(f"{value:.6g}" for value in eigenvalues[:3])
        raise MeasurementFileError(
            f"{modes[0].place} and the other modes hold poles with positive real parts ({shown}), "
            "and modal A does not say in which unit; one is needed, since they are against the "
            'format. Say it: modal_parameters.read(path, poles="Hz"), or poles="rad/s".'
        )
    return (-1.0 if np.all(grows) else 1.0) * (1.0 if unit == "Hz" else 1 / math.tau)


def _unit_by_modal_a(modes: list[Dataset], eigenvalues: np.ndarray) -> str | None:
    """Unit of poles by modal A, which is twice the pole [rad/s] of shapes of unit modal mass.

    None where it says neither, as of shapes that are scaled in another way.
    """
    ratio = np.abs([dataset.fields["modal_a"] for dataset in modes]) / np.abs(eigenvalues)
    units = {"rad/s": 2.0, "Hz": 2.0 * math.tau}
    agreed = [unit for unit, known in units.items() if np.allclose(ratio, known, rtol=ALIKE)]
    return agreed[0] if agreed else None


def _pole(dataset: Dataset, scale: float) -> tuple[float, float]:
    """Natural frequency [Hz] and damping ratio [1]."""
    fields = dataset.fields
    if fields["analysis_type"] not in COMPLEX:
        return float(fields["freq"]), float(fields["modal_damp_vis"])
    size = abs(fields["eig"])
    return float(size * abs(scale)), float(-fields["eig"].real * np.sign(scale) / size)


def _translations(dataset: Dataset) -> np.ndarray:
    """Translations of each node; rotations behind them are left out."""
    return np.column_stack([dataset.fields[f"r{axis}"] for axis in (1, 2, 3)])
