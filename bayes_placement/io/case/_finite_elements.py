"""_model: in, a case with a finite element model; out, where it may be read, and its modes.

Not known here: sensors, measurements, priors, how fields are checked.
"""

import itertools
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Int

from ..._types import Parameter
from ...modes.finite_elements import finite_elements, interpolation, soft_supports
from ...modes.finite_elements.matrices import Matrices
from ...modes.finite_elements.nodal_modes import NodalModes
from ...modes.finite_elements.soft_supports import SupportMotion
from ...positions.tolerances import Box, Member, Support
from .. import matrix_files, npz_modes
from ._json_fields import CaseError, Fields, Rule, load, numbers, one_of, positive

_BAND_FACTOR = 5
"""Modes are kept up to so many times the band; the static flexibility stands for the others."""

_AGREEMENT = 1e-4  # of the natural frequencies handed over beside the matrices


_HAIR = 1e-9  # [m] between a node and where the case draws it


class _Kind(NamedTuple):
    """A kind of model: its shape functions, pieces and supports, and how it moves."""

    read: Callable[[Matrices, Int[np.ndarray, "element corner"]], interpolation.Interpolation]
    pieces: Callable[[Fields], dict[str, Support]]
    soft: Callable[[Matrices, Fields], dict[str, SupportMotion]]
    axes: tuple[int, ...]
    has_members: bool


class Model:
    """A finite element model that a case names, with the files that belong to it."""

    def __init__(self, case: Fields):
        self.fields = case.inside("structure")
        self.kind = _KINDS[self.fields.take("type", one_of(*_KINDS))]
        rule = Rule("a folder, relative to that of the case,", "../models/plate", _is_folder)
        self.folder = (case.file.parent / case.take("nominal_fe_model", rule)).resolve()
        self.grid = npz_modes.read_grid(self.folder / "nominal.npz")
        self.pieces = self.kind.pieces(self.fields)
        self._check_structure()

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest coordinates of the nodes [m]."""
        return self.grid.position.min(axis=0), self.grid.position.max(axis=0)

    def modes(self, highest: float, modulus: Parameter, density: Parameter) -> NodalModes:
        """Modes for lines up to a highest one [Hz].

        Raises
        ------
        CaseError
            If a file is wrong, or the modes handed over are not those of the matrices.
        """
        matrices = self.matrices
        reading = self.kind.read(matrices, self.corners)
        found = finite_elements.modes(
            matrices,
            reading,
            up_to=_BAND_FACTOR * highest,
            pieces=tuple(self.pieces.values()),
            members=self._members() if self.kind.has_members else {},
            soft=self.kind.soft(matrices, self.fields),
            youngs_modulus=modulus,
            density=density,
            nominal=(self._nominal("youngs_modulus_Pa"), self._nominal("density_kg_m3")),
        )
        self._check_frequencies(np.sqrt(found.squares) / (2 * np.pi))
        return found

    @cached_property
    def matrices(self) -> Matrices:
        """Stiffness and mass, and the stiffness of each region.

        Raises
        ------
        CaseError
            If a file holds no such matrix.
        """
        try:
            whole = matrix_files.read(
                self.folder / "K.npz", self.folder / "M.npz", regions=self._region_files()
            )
            return Matrices(
                stiffness=whole.stiffness,
                mass=whole.mass,
                position=self.grid.position,
                dof=self.grid.dof,
                node=self.grid.node,
                fixed=self.grid.fixed,
                regions=whole.regions,
            )
        except ValueError as error:
            raise CaseError(f"The model in {self.folder} cannot be used: {error}") from error

    @cached_property
    def corners(self) -> Int[np.ndarray, "element corner"]:
        """Indices of the nodes of each element.

        Raises
        ------
        CaseError
            If the model has no elements.
        """
        if self.grid.element is None:
            raise CaseError(
                f"{self.folder / 'nominal.npz'} has no array `elements`; the nodes of each element "
                "are needed, since sensors sit between nodes. Export them beside `nodes`."
            )
        order = np.argsort(self.grid.node)
        place = np.searchsorted(self.grid.node[order], self.grid.element)
        return order[np.minimum(place, len(order) - 1)]

    def _region_files(self) -> dict[str, Path]:
        described = load(self.folder / "model.json").content.get("regions", [])
        return {
            str(name): self.folder / f"K_region_{number:02d}.npz"
            for number, name in enumerate(described)
        }

    def _members(self) -> dict[str, Any]:
        """Geometric stiffness of each member: of the elements both of whose ends lie on it."""
        return {
            str(one.content["name"]): interpolation.frame_geometric_stiffness(
                self.matrices, self._on(*(np.array(one.content[end]) for end in ("start", "end")))
            )
            for one in self.fields.each("members")
        }

    def _on(self, start: np.ndarray, end: np.ndarray) -> Int[np.ndarray, "element 2"]:
        step = end - start
        share = (self.grid.position - start) @ step / (step @ step)
        foot = start + np.clip(share, 0, 1)[:, None] * step
        near = np.linalg.norm(self.grid.position - foot, axis=1) < 1e-9 * np.linalg.norm(step)
        return self.corners[near[self.corners].all(axis=1)]

    def _nominal(self, name: str) -> float:
        return float(self.fields.take(name, positive("SI", 1.0)))

    def _check_structure(self) -> None:
        """Refuse a model of something else than the case draws."""
        beside = load(self.folder / "model.json").inside("structure")
        for name, value in beside.content.items():
            if name in self.fields.content and self.fields.content[name] != value:
                raise CaseError(
                    f"{beside.file} says structure.{name} is {value!r}, but {self.fields.file} "
                    f"says {self.fields.content[name]!r}; both must agree, since either could be "
                    "meant. Correct the one that is wrong."
                )

    def _check_frequencies(self, frequency: np.ndarray) -> None:
        given = npz_modes.read(self.folder / "nominal.npz").natural_frequency
        count = min(len(given), len(frequency))
        wrong = np.abs(frequency[:count] - given[:count]) > _AGREEMENT * given[:count]
        if wrong.any():
            mode = int(np.argmax(wrong))
            raise CaseError(
                f"The matrices in {self.folder} have mode {mode + 1} at {frequency[mode]:.6g} Hz, "
                f"but nominal.npz hands it over at {given[mode]:.6g} Hz; both must agree, since "
                "either could be meant. Export both from the same model."
            )


def _frame_members(fields: Fields) -> dict[str, Support]:
    every = fields.each("members", least=1)
    place = numbers("three coordinates [m]", [0.0, 0.0, 0.9], lambda value: True)
    return {
        str(one.take("name", _NAME)): _member(one.take("start", place), one.take("end", place))
        for one in every
    }


def _member(start: list[Any], end: list[Any]) -> Support:
    """A member; one along an axis by its coordinates, which say more than a distance."""
    skew = np.count_nonzero(np.subtract(end, start)) != 1
    return Member(start, end) if skew else _between(start, end)


def _plate_surface(fields: Fields) -> dict[str, Support]:
    x, y = (float(fields.take(name, positive("m", 0.4))) for name in ("size_x_m", "size_y_m"))
    return {"plate": _between([0.0, 0.0, 0.0], [x, y, 0.0])}


def _feet(matrices: Matrices, fields: Fields) -> dict[str, SupportMotion]:
    """Bending rotations of each end of a member that is clamped."""
    clamped = np.unique(matrices.dof[matrices.fixed[matrices.dof[matrices.fixed, 1] > 3], 0])
    found = {}
    for one in fields.each("members"):
        start, end = (np.array(one.content[which], dtype=float) for which in ("start", "end"))
        for corner in (start, end):
            near = np.linalg.norm(matrices.position - corner, axis=1) < _HAIR
            for node in np.intersect1d(matrices.node[near], clamped):
                name = f"of the {one.content['name']} at ({', '.join(f'{x:g}' for x in corner)}) m"
                found[name] = soft_supports.rotations(matrices, int(node), along=end - start)
    return found


def _edges(matrices: Matrices, fields: Fields) -> dict[str, SupportMotion]:
    """Each edge of a rectangular plate that is held across its plane."""
    held = matrices.dof[matrices.fixed[matrices.dof[matrices.fixed, 1] == 3], 0]
    holds = np.isin(matrices.node, held)
    low, high = matrices.position.min(axis=0), matrices.position.max(axis=0)
    found = {}
    for axis, value in itertools.product((0, 1), (low, high)):
        on = np.abs(matrices.position[:, axis] - value[axis]) < _HAIR
        if holds[on].all():
            start, end = low.copy(), high.copy()
            start[axis] = end[axis] = value[axis]
            name = f"along {'xy'[axis]} = {value[axis]:g} m"
            found[name] = soft_supports.edge(matrices, start, end)
    return found


def _between(start: list[Any], end: list[Any]) -> Box:
    return Box(np.add(start, end) / 2, within=np.abs(np.subtract(end, start)) / 2)


def _is_folder(value: Any) -> bool:
    return isinstance(value, str) and bool(value.strip())


_NAME = Rule("a name", "crossbar", _is_folder)
_KINDS = {
    "space frame, Euler-Bernoulli members (axial, two bendings, torsion)": _Kind(
        interpolation.frame, _frame_members, _feet, (1, 2, 3), True
    ),
    "thin Kirchhoff plate": _Kind(interpolation.plate, _plate_surface, _edges, (3,), False),
}
