"""Reads files by libraries that are extras, in a separate process: see `_child.py`."""

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import meshio
    import pandas as pd
    from ansys.mapdl.reader.full import FullFile

Read = tuple[dict[str, np.ndarray], dict[str, Any]]
"""Arrays by name, and what else the file states."""

TIMES = "times of group {}"
_EPOCH = np.datetime64("1970-01-01T00:00:00")


def read(path: str, extra: str, **settings: Any) -> Read:
    """Read a file by the library of an extra."""
    if extra == "nastran":
        return _matrices_by_name(path, **settings) if settings["names"] else _tables_of_modes(path)
    return {"tdms": _tdms, "mdf": _mdf, "mesh": _mesh, "ansys": _ansys}[extra](path)


def _tdms(path: str) -> Read:
    """Samples by `group/channel`, with units, rates, starts [s] and what was left out."""
    from nptdms import TdmsFile

    arrays: dict[str, np.ndarray] = {}
    metadata: dict[str, dict[str, object]] = {"units": {}, "rates": {}, "starts": {}, "faults": {}}
    for group in TdmsFile.read(path).groups():
        for channel in group.channels():
            name = f"{group.name}/{channel.name}"
            samples = np.asarray(channel[:])
            if samples.dtype.kind not in "iuf" or not samples.size:
                metadata["faults"][name] = "it holds no numbers"
                continue
            arrays[name] = samples
            metadata["units"][name] = str(channel.properties.get("unit_string", ""))
            step = float(channel.properties.get("wf_increment", 0.0))
            if step > 0:
                metadata["rates"][name] = 1 / step
                metadata["starts"][name] = _start(channel.properties)
    return arrays, metadata


def _start(properties: Mapping[str, Any]) -> float:
    """Time of the first sample [s], since the epoch where the file states a date."""
    date = np.datetime64(properties.get("wf_start_time", _EPOCH))
    return (date - _EPOCH) / np.timedelta64(1, "s") + properties.get("wf_start_offset", 0.0)


def _mdf(path: str) -> Read:
    """Samples by name and times by group, with units, groups and what was left out."""
    from asammdf import MDF

    arrays: dict[str, np.ndarray] = {}
    metadata: dict[str, dict[str, object]] = {"units": {}, "groups": {}, "faults": {}}
    with MDF(path) as file:
        for name, places in file.channels_db.items():
            if len(places) > 1:
                groups = ", ".join(str(group) for group, _ in places)
                metadata["faults"][name] = (
                    f"{len(places)} channels have this name, in groups {groups}"
                )
                continue
            ((group, index),) = places
            signal = file.get(name, group=group, index=index)
            samples = np.asarray(signal.samples)
            if samples.dtype.kind not in "iuf" or samples.ndim != 1 or not samples.size:
                metadata["faults"][name] = "it holds no numbers in a row"
                continue
            arrays[name] = samples
            arrays[TIMES.format(group)] = np.asarray(signal.timestamps)
            metadata["units"][name] = str(signal.unit or "")
            metadata["groups"][name] = group
    return arrays, metadata


def _mesh(path: str) -> Read:
    """Points, elements and sets of a mesh as arrays `KIND NAME`."""
    import meshio

    content = meshio.read(path)
    elements: dict[str, list[np.ndarray]] = {}
    for block in content.cells:
        elements.setdefault(block.type, []).append(np.asarray(block.data, dtype=np.int64))
    corners = {f"elements {name}": np.concatenate(blocks) for name, blocks in elements.items()}
    sets = {f"set {name}": nodes for name, nodes in _node_sets(content).items()}
    return {"points": np.asarray(content.points, dtype=float), **corners, **sets}, {}


def _node_sets(content: "meshio.Mesh") -> dict[str, np.ndarray]:
    """Nodes, from 0, of each named set; of a set of elements all of their nodes."""
    sets = {
        name: np.unique(np.asarray(points, dtype=np.int64))
        for name, points in content.point_sets.items()
    }
    element_sets = {**_physical_groups(content), **content.cell_sets}
    for name, cells in element_sets.items():
        corners = [
            block.data[np.asarray(rows, dtype=int)].ravel()
            for block, rows in zip(content.cells, cells, strict=True)
            if rows is not None and len(rows)
        ]
        if corners and not name.startswith("gmsh:"):
            sets[name] = np.unique(np.concatenate(corners)).astype(np.int64)
    return sets


def _physical_groups(content: "meshio.Mesh") -> dict[str, list[np.ndarray]]:
    """Elements of each physical group of Gmsh, which meshio gives as tags."""
    tags = content.cell_data.get("gmsh:physical")
    if tags is None:
        return {}
    return {
        name: [
            np.flatnonzero(tag == group) if block.dim == dimension else np.zeros(0, dtype=int)
            for block, tag in zip(content.cells, tags, strict=True)
        ]
        for name, (group, dimension) in content.field_data.items()
    }


THIRD_RECORD = 103 + 100 + 3  # behind the header: its place, its length, marks of the record
TRANSLATIONS = [1, 2, 3]


class RefusedAnsysFile(Exception):  # noqa: N818, its name is the word that people read
    """A file that is not read; the process that asked for it makes our error of its words."""


def _ansys(path: str) -> Read:
    """Entries of the matrices of a `.full` file, or modes and nodes of a `.rst` file."""
    from ansys.mapdl import reader
    from ansys.mapdl.reader.full import FullFile

    file = reader.read_binary(path)
    return _matrices(file) if isinstance(file, FullFile) else _modes(file)


def _matrices(file: "FullFile") -> Read:
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


def _modes(file: Any) -> Read:
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


SHAPE_TABLES = ("oug", "bophig")


def _matrices_by_name(path: str, names: list[str]) -> Read:
    """Entries of matrices, and the names of all in the file."""
    import scipy.sparse
    from pyyeti.nastran import op4

    in_file = op4.dir(path, verbose=False)[0]
    content = op4.read(path, names, sparse=(True, scipy.sparse.coo_array))
    arrays: dict[str, np.ndarray] = {}
    for name, matrix in content.items():
        arrays |= {f"{name} row": matrix.row, f"{name} column": matrix.col}
        arrays |= {f"{name} value": matrix.data, f"{name} size": np.array(matrix.shape)}
    return arrays, {"in file": in_file}


def _tables_of_modes(path: str) -> Read:
    """Nodes and eigenvectors in the basic system, and the table of eigenvalues."""
    from pyyeti.nastran import op2

    warnings.filterwarnings("error", message="(?s).*garbled")
    with op2.OP2(path) as file:
        content = file.rdparampost(get_mats=False, get_ougs=True, get_dr_tables=False)
    shapes = [key for key in content if key.startswith(SHAPE_TABLES) and content[key] is not None]
    found = {"eigenvectors": shapes, "nodes": "uset" in content, "unplaced": []}
    if len(shapes) != 1 or not found["nodes"]:
        return {}, found
    node, motion, frequency = _eigenvectors(content[shapes[0]])
    known = content["uset"].index.get_level_values("id")
    found["unplaced"] = node[~np.isin(node, known)].tolist()
    if found["unplaced"]:
        return {}, found
    position, rotation = grids(content["uset"], node)
    motion[:, :3] = rotated(motion[:, :3], rotation)
    motion[:, 3:] = rotated(motion[:, 3:], rotation)
    arrays = {"node": node, "position": position, "shape": motion, "frequency": frequency}
    lama = [content[key] for key in content if key.startswith("lama")]
    return arrays | ({"eigenvalues": lama[-1]} if lama else {}), found


def _eigenvectors(table: "pd.DataFrame") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers of the grid points, their motion in their own systems, and frequencies [Hz]."""
    grid = table.index.get_level_values("DOF").to_numpy() > 0  # scalar points have no direction
    number = table.index.get_level_values("Node").to_numpy()[grid][::6].astype(np.int64)
    motion = table.to_numpy()[grid].reshape(number.size, 6, -1)
    return number, motion, table.columns.get_level_values(1).to_numpy().astype(float)


def grids(uset: "pd.DataFrame", number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions in the basic system, and the rotation of motion into that system."""
    from pyyeti.nastran import n2p

    points = uset[uset.index.get_level_values("dof") > 0]
    points = points[points.index.get_level_values("id").isin(number)]
    points = points.assign(nasset=n2p.mkusetmask("b"))  # pyyeti gives zeros for some other sets
    known = points.index.get_level_values("id").to_numpy()[::6]
    row = np.argsort(known)[np.searchsorted(np.sort(known), number)]
    table = points[["x", "y", "z"]].to_numpy().reshape(-1, 6, 3)
    rotation = np.broadcast_to(np.eye(3), (known.size, 3, 3))
    if table[:, 1, 0].any():  # a displacement system is not the basic system
        rotation = n2p.rbgeom_uset(points)[:, :3].reshape(-1, 6, 3)[:, :3]
    return table[row, 0], rotation[row]


def rotated(motion: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Motion [node, axis, mode] turned by the rotation of each node."""
    return np.einsum("nji,njm->nim", rotation.astype(motion.dtype), motion)
