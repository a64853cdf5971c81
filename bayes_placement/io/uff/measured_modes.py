"""Measured modes of a universal file (dataset 55): frequency, damping and shape by node."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from ...positions.channel import Channel
from ._datasets import DATA_AT_NODES, FUNCTION, Dataset, MeasurementFileError, blocks_of
from ._datasets import load as datasets_of
from ._decode import COMPLEX, NORMAL

ALIKE = 1e-2
"""Relative difference of numbers that are one; those that are told apart differ by 2 pi."""

_MOTIONS = (8, 11, 12)  # displacement, velocity, acceleration: the same shape at one frequency

Arguments: TypeAlias = dict[str, Any]
"""Arguments of `ModalParameters`, by name."""


def holds_modes_alone(path: Path) -> bool:
    """Whether a universal file has data at nodes (dataset 55) and no functions (58)."""
    kinds = {block.number for block in blocks_of(path)}
    return DATA_AT_NODES in kinds and FUNCTION not in kinds


def load(path: Path, names: Mapping[int, str], poles: str | None = None) -> Arguments:
    """Read the modes of a universal file as arguments of `ModalParameters`, without deviations.

    Sensors are named by the number of the node; poles of complex modes are in `rad/s` or `Hz`.
    """
    datasets = [
        entry for entry in datasets_of(path, DATA_AT_NODES) if entry.number == DATA_AT_NODES
    ]
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
    nodes = np.unique(np.concatenate([_nodes(dataset) for dataset in modes]))
    shapes = np.stack([_shape(modes[place], nodes) for place in order], axis=-1)
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


def _nodes(dataset: Dataset) -> np.ndarray:
    return np.asarray(dataset.fields["node_nums"], dtype=np.int64)


def _shape(dataset: Dataset, nodes: np.ndarray) -> np.ndarray:
    """Translations of the nodes [node, axis], zero without a record."""
    node_numbers, fields = _nodes(dataset), dataset.fields
    columns = [np.asarray(fields[f"r{axis}"]) for axis in (1, 2, 3)]
    if np.unique(node_numbers).size < node_numbers.size or any(
        column.size != node_numbers.size for column in columns
    ):
        raise MeasurementFileError(
            f"{dataset.place} holds a node twice or not three translations of each; each node once "
            "is needed with its three translations. Export the mode again."
        )
    shape = np.zeros((nodes.size, 3), dtype=np.result_type(*columns))
    shape[np.searchsorted(nodes, node_numbers)] = np.column_stack(columns)
    return shape
