"""Reads files of Ansys by ansys-mapdl-reader, in a separate process: see `_child.py`."""

from typing import Any

import numpy as np
from ansys.mapdl import reader
from ansys.mapdl.reader.full import FullFile

THIRD_RECORD = 103 + 100 + 3  # behind the header: its place, its length, marks of the record
TRANSLATIONS = [1, 2, 3]


class RefusedAnsysFile(Exception):  # noqa: N818, its name is the word that people read
    """A file that is not read; the process that asked for it makes our error of its words."""


def read(path: str) -> tuple[dict[str, np.ndarray], dict[str, object]]:
    """Entries of the matrices of a `.full` file, or modes and nodes of a `.rst` file."""
    file = reader.read_binary(path)
    return _matrices(file) if isinstance(file, FullFile) else _modes(file)


def _matrices(file: FullFile) -> tuple[dict[str, np.ndarray], dict[str, object]]:
    """Upper triangles, sorted by node and direction; rows that are held are empty."""
    header = file._header
    if header["ncefull"]:
        raise RefusedAnsysFile("it holds constraint equations, which are not read")
    dof, stiffness, mass = file.load_km(sort=True)
    if stiffness is None or mass is None:
        raise RefusedAnsysFile("it holds no stiffness or no mass; write it in a modal analysis")
    known = [int(number) for number in file.read_record(THIRD_RECORD)[: int(header["numdof"])]]
    counts = {int(count) for count in file.ndof}
    complete = counts <= {len(known)} or (counts <= {3, len(known)} and known[:3] == TRANSLATIONS)
    if not complete:
        raise RefusedAnsysFile(f"its nodes have {sorted(counts)} of the degrees of freedom {known}")
    arrays = {"dof": np.column_stack([dof[:, 0], np.array(known)[dof[:, 1]]]).astype(np.int64)}
    for name, matrix in (("stiffness", stiffness.tocoo()), ("mass", mass.tocoo())):
        arrays[f"{name} row"] = matrix.row.astype(np.int64)
        arrays[f"{name} column"] = matrix.col.astype(np.int64)
        arrays[f"{name} value"] = matrix.data
    return arrays, {"units": str(file._standard_header["units"])}


def _modes(file: Any) -> tuple[dict[str, np.ndarray], dict[str, object]]:
    """Natural frequencies, shapes [mode, node, direction] and nodes."""
    names = list(file.result_dof(0))
    if file.n_sector and file.n_sector > 1:
        raise RefusedAnsysFile("it holds a cyclic sector")
    shapes = [file.nodal_solution(mode) for mode in range(file.n_results)]
    nodes = dict(zip(file.mesh.nnum.tolist(), np.asarray(file.mesh.nodes).tolist(), strict=True))
    numbers = shapes[0][0]
    arrays = {
        "node": np.asarray(numbers, dtype=np.int64),
        "position": np.array([nodes[number] for number in numbers.tolist()])[:, :3],
        "frequency": np.asarray(file.time_values, dtype=float),
        "shape": np.array([values for _, values in shapes], dtype=float),
    }
    return arrays, {"units": str(file._resultheader.get("units", "")), "directions": names}
