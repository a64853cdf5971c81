"""Measured modes of a universal file (dataset 55): frequency, damping and shape by node."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...positions.channel import Channel
from ._datasets import DATA_AT_NODES, FUNCTION, Dataset, MeasurementFileError
from ._datasets import load as datasets_of

_NORMAL, _COMPLEX = 2, (3, 7)
_MOTIONS = (8, 11, 12)  # displacement, velocity, acceleration: the same shape at one frequency

_OPENING = r"^ {{4}}-1 *\r?\n {{4}}{number}[ b\r\n]"


def holds_modes_alone(path: Path) -> bool:
    """Whether a universal file has data at nodes (dataset 55) and no functions (58)."""
    data = path.read_bytes()
    functions, at_nodes = (
        re.search(_OPENING.format(number=number).encode(), data, re.MULTILINE)
        for number in (FUNCTION, DATA_AT_NODES)
    )
    return functions is None and at_nodes is not None


def load(path: Path, names: Mapping[int, str]) -> dict[str, Any]:
    """Read the modes of a universal file as arguments of `ModalParameters`, without deviations.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    MeasurementFileError
        If it is malformed, or holds no modes.
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
    poles = np.array([_pole(dataset) for dataset in modes])
    order = np.argsort(poles[:, 0])
    nodes = np.unique(np.concatenate([_nodes(dataset) for dataset in modes]))
    shapes = np.stack([_shape(modes[place], nodes) for place in order], axis=-1)
    moving = np.argwhere(np.any(shapes, axis=-1))
    damping = poles[order, 1]
    return {
        "natural_frequency": poles[order, 0],
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
    return analysis in (_NORMAL, *_COMPLEX) and motion in _MOTIONS


def _pole(dataset: Dataset) -> tuple[float, float]:
    """Natural frequency [Hz] and damping ratio [1]."""
    fields = dataset.fields
    if fields["analysis_type"] == _NORMAL:
        return float(fields["freq"]), float(fields["modal_damp_vis"])
    size = abs(fields["eig"])
    if size == 0:
        raise MeasurementFileError(
            f"{dataset.place} holds the eigenvalue 0; a pole [rad/s] is needed, since frequency "
            "and damping are read from it. Leave rigid-body modes out of the export."
        )
    return float(size / (2 * np.pi)), float(-fields["eig"].real / size)


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
