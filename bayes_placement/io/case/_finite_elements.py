"""Finite element model that a case names: its matrices, its modes, and where sensors can be."""

import itertools
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Int
from scipy.sparse import csc_array

from ..._shared.dimensions import Parameter
from ...modes import finite_elements
from ...modes.finite_elements import interpolation, soft_supports
from ...modes.finite_elements.matrices import Matrices
from ...modes.finite_elements.nodal_modes import NodalModes
from ...modes.finite_elements.soft_supports import SupportMotion
from ...positions.channel import LONGEST, is_printable
from ...positions.tolerances import Box, Member, Tolerance
from ...positions.vectors import Vector
from .. import matrix_files, npz_modes
from ._json_fields import CaseError, FieldRule, JsonObject, choice, load, numbers, positive
from ._runs import inside

_FILES = ("nominal.npz", "K.npz", "M.npz")
"""Files of every model."""

_BAND_FACTOR = 5
"""Modes are kept up to this multiple of the band; static flexibility replaces the others."""

_AGREEMENT = 1e-4  # relative, of the natural frequencies in nominal.npz and of the matrices
_ROUND_OFF = 1e-9  # [m] between a node and its position in `case.json`


class _ModelKind(NamedTuple):
    """A kind of finite element model.

    `interpolate` makes the shape functions of matrices and elements; `pieces` are members or
    surfaces on which something may be attached, `soft_supports` motions of supports that may be
    compliant, by name; `axes` are directions in which it moves.
    """

    interpolate: Callable[
        [Matrices, Int[np.ndarray, "element corner"]], interpolation.Interpolation
    ]
    pieces: Callable[[JsonObject], dict[str, Tolerance]]
    soft_supports: Callable[[Matrices, JsonObject], dict[str, SupportMotion]]
    axes: tuple[int, ...]
    has_members: bool


class FiniteElementStructure:
    """A finite element model that a case names, with the files that belong to it."""

    def __init__(self, case: JsonObject):
        self.fields = case.object("structure")
        self.kind = _MODEL_KINDS[self.fields.value("type", choice(*_MODEL_KINDS))]
        self.folder = _model_folder(case)
        _check_files(case, self.folder)
        self.nodes = npz_modes.read_nodes(inside(self.folder, "nominal.npz"))
        self.pieces = self.kind.pieces(self.fields)
        self._check_structure()

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest coordinates of the nodes [m]."""
        return self.nodes.position.min(axis=0), self.nodes.position.max(axis=0)

    def modes(self, highest: float, modulus: Parameter, density: Parameter) -> NodalModes:
        """Modes for lines up to a highest one [Hz]."""
        matrices = self.matrices
        modes = finite_elements.modes(
            matrices,
            self.kind.interpolate(matrices, self.corners),
            up_to=_BAND_FACTOR * highest,
            pieces=tuple(self.pieces.values()),
            members=self._members() if self.kind.has_members else {},
            soft=self.kind.soft_supports(matrices, self.fields),
            youngs_modulus=modulus,
            density=density,
            nominal=(self._nominal("youngs_modulus_Pa"), self._nominal("density_kg_m3")),
        )
        self._check_frequencies(np.sqrt(modes.eigenvalues) / (2 * np.pi))
        return modes

    @cached_property
    def matrices(self) -> Matrices:
        """Stiffness and mass, and the stiffness of each region."""
        try:
            system = matrix_files.read(
                inside(self.folder, "K.npz"),
                inside(self.folder, "M.npz"),
                regions=self._region_files(),
            )
            return Matrices(
                stiffness=system.stiffness,
                mass=system.mass,
                position=self.nodes.position,
                dof=self.nodes.dof,
                node=self.nodes.node,
                fixed=self.nodes.fixed,
                regions=system.regions,
            )
        except ValueError as error:
            raise CaseError(f"The model in {self.folder} cannot be used: {error}") from error

    @cached_property
    def corners(self) -> Int[np.ndarray, "element corner"]:
        """Indices of the nodes of each element."""
        if self.nodes.element is None:
            raise CaseError(
                f"{self.folder / 'nominal.npz'} has no array `elements`; the nodes of each element "
                "are needed, since sensors may lie between nodes. Export them with `nodes`."
            )
        order = np.argsort(self.nodes.node)
        place = np.searchsorted(self.nodes.node[order], self.nodes.element)
        return order[np.minimum(place, len(order) - 1)]

    def _region_files(self) -> dict[str, Path]:
        model = load(inside(self.folder, "model.json"))
        names = model.value("regions", _REGIONS) if model.has("regions") else []
        numbered = [inside(self.folder, f"K_region_{n:02d}.npz") for n in range(len(names))]
        files = dict(zip(names, numbered, strict=True))
        for name, file in files.items():
            if not file.is_file():
                raise CaseError(
                    f'{model.file} names the region "{name}", but there is no file {file}; the '
                    "stiffness of each region is needed, in the order of their names. Export it, "
                    "or leave the region out."
                )
        unnamed = {*self.folder.glob("K_region_*.npz")} - {*numbered}
        if unnamed:  # as where `regions` is misspelt
            raise CaseError(
                f"{model.file} names {len(names)} regions, and {min(unnamed).name} lies beside it; "
                "the name of each region is needed, in the order of the files, since else its "
                'stiffness would be ignored: "regions": ["left", "right"].'
            )
        return files

    def _members(self) -> dict[str, csc_array]:
        """Geometric stiffness of each member."""
        return {
            str(member.content["name"]): interpolation.frame_geometric_stiffness(
                self.matrices, self._elements_on(member.content["start"], member.content["end"])
            )
            for member in self.fields.objects("members")
        }

    def _elements_on(self, start: Vector, end: Vector) -> Int[np.ndarray, "element 2"]:
        """Elements whose nodes all lie on the line between two points."""
        vector = np.subtract(end, start)
        position = self.nodes.position
        share = (position - start) @ vector / (vector @ vector)
        nearest = start + np.clip(share, 0, 1)[:, None] * vector
        on_line = np.linalg.norm(position - nearest, axis=1) < 1e-9 * np.linalg.norm(vector)
        return self.corners[on_line[self.corners].all(axis=1)]

    def _nominal(self, name: str) -> float:
        return float(self.fields.value(name, positive("SI", 1.0)))

    def _check_structure(self) -> None:
        """Refuse a model of another structure than the case describes."""
        modelled = load(inside(self.folder, "model.json")).object("structure")
        for name, value in modelled.content.items():
            if name in self.fields.content and self.fields.content[name] != value:
                raise CaseError(
                    f"{modelled.file} says structure.{name} is {value!r}, but {self.fields.file} "
                    f"says {self.fields.content[name]!r}; both must agree, since either could be "
                    "meant. Correct the one that is wrong."
                )

    def _check_frequencies(self, frequency: np.ndarray) -> None:
        stated = npz_modes.read(self.folder / "nominal.npz").natural_frequency
        count = min(len(stated), len(frequency))
        wrong = np.abs(frequency[:count] - stated[:count]) > _AGREEMENT * stated[:count]
        if wrong.any():
            mode = int(np.argmax(wrong))
            raise CaseError(
                f"The matrices in {self.folder} have mode {mode + 1} at {frequency[mode]:.6g} Hz, "
                f"but nominal.npz states {stated[mode]:.6g} Hz; both must agree, since "
                "either could be meant. Export both from the same model."
            )


def _model_folder(case: JsonObject) -> Path:
    """Folder of the model, among the folders next to the case: a file opens nothing else."""
    start = case.file.resolve().parent
    folder = start.parents[min(1, len(start.parents) - 1)]
    rule = FieldRule(
        f"a folder in {folder}, relative to that of the case,",
        "../models/plate",
        lambda value: (
            _is_text(value)
            and not Path(value).is_absolute()
            and (start / value).resolve().is_relative_to(folder)
        ),
    )
    return (start / case.value("nominal_fe_model", rule)).resolve()


def _check_files(case: JsonObject, folder: Path) -> None:
    """Refuse a case whose model is not there."""
    missing = [name for name in _FILES if not (folder / name).is_file()]
    if missing:
        stated = case.content["nominal_fe_model"]
        raise CaseError(
            f"{case.file}: the field nominal_fe_model is {stated!r}, but there is no "
            f"{', '.join(missing)} in {folder}; the finite element model is needed, since the case "
            "is read on it. Copy its folder there, or correct nominal_fe_model."
        )


def _frame_members(fields: JsonObject) -> dict[str, Tolerance]:
    point = numbers("three coordinates [m]", [0.0, 0.0, 0.9], lambda value: True)
    return {
        str(member.value("name", _NAME)): _member(
            member.value("start", point), member.value("end", point)
        )
        for member in fields.objects("members", least=1)
    }


def _member(start: Vector, end: Vector) -> Tolerance:
    """A member; along an axis a box, whose coordinates say more than a distance does."""
    inclined = np.count_nonzero(np.subtract(end, start)) != 1
    return Member(start, end) if inclined else _box(start, end)


def _plate_surface(fields: JsonObject) -> dict[str, Tolerance]:
    x, y = (float(fields.value(name, positive("m", 0.4))) for name in ("size_x_m", "size_y_m"))
    return {"plate": _box([0.0, 0.0, 0.0], [x, y, 0.0])}


def _clamped_ends(matrices: Matrices, fields: JsonObject) -> dict[str, SupportMotion]:
    """Bending rotations of each clamped end of a member."""
    clamped = np.unique(matrices.dof[matrices.fixed[matrices.dof[matrices.fixed, 1] > 3], 0])
    motions = {}
    for member in fields.objects("members"):
        start, end = (np.array(member.content[key], dtype=float) for key in ("start", "end"))
        for corner in (start, end):
            at_corner = np.linalg.norm(matrices.position - corner, axis=1) < _ROUND_OFF
            coordinates = ", ".join(f"{coordinate:g}" for coordinate in corner)
            name = f"of the {member.content['name']} at ({coordinates}) m"
            for node in np.intersect1d(matrices.node[at_corner], clamped):
                motions[name] = soft_supports.rotations(matrices, int(node), along=end - start)
    return motions


def _supported_edges(matrices: Matrices, fields: JsonObject) -> dict[str, SupportMotion]:
    """Edge motion of each edge of a rectangular plate that is fixed out of plane."""
    fixed_nodes = matrices.dof[matrices.fixed[matrices.dof[matrices.fixed, 1] == 3], 0]
    is_fixed = np.isin(matrices.node, fixed_nodes)
    low, high = matrices.position.min(axis=0), matrices.position.max(axis=0)
    motions = {}
    for axis, corner in itertools.product((0, 1), (low, high)):
        on_edge = np.abs(matrices.position[:, axis] - corner[axis]) < _ROUND_OFF
        if is_fixed[on_edge].all():
            start, end = low.copy(), high.copy()
            start[axis] = end[axis] = corner[axis]
            name = f"along {'xy'[axis]} = {corner[axis]:g} m"
            motions[name] = soft_supports.edge(matrices, start, end)
    return motions


def _box(start: Vector, end: Vector) -> Box:
    return Box(np.add(start, end) / 2, within=np.abs(np.subtract(end, start)) / 2)


def _is_text(value: object) -> bool:
    return isinstance(value, str) and is_printable(value)


_REGIONS = FieldRule(
    "a list of names, each once",
    ["crossbar", "left column"],
    lambda value: (
        isinstance(value, list) and all(map(_is_text, value)) and len(set(value)) == len(value)
    ),
)
_NAME = FieldRule(f"a name of at most {LONGEST} letters", "crossbar", _is_text)
_MODEL_KINDS = {
    "space frame, Euler-Bernoulli members (axial, two bendings, torsion)": _ModelKind(
        interpolation.frame, _frame_members, _clamped_ends, (1, 2, 3), True
    ),
    "thin Kirchhoff plate": _ModelKind(
        interpolation.plate, _plate_surface, _supported_edges, (3,), False
    ),
}
