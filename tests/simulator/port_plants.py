"""All modes of a line or plate with cuts, and what is attached to its ports.

A port is a row over the freedoms of the mesh: a deflection, a slope, the difference of two places;
a part of the structure is many of them. Every mode is kept, so that the sum is the direct solution
of the mesh. Independent of bayes_placement.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.linalg

from tests.simulator.fine_elements import (
    NOTHING,
    Line,
    Mesh,
    damping_ratios,
    deflection,
    element_matrices,
    held,
    quadratic,
    slope,
)
from tests.simulator.ritz_plates import Plate, plate_plant

GAUSS, WEIGHTS = np.polynomial.legendre.leggauss(2)
"""Two points an element: exact for the squares of curvature and strain."""

PATCH = 6
"""Points of Gauss along each side of a patch of a plate."""


@dataclass(frozen=True)
class Cut:
    """Where the slope of a beam, or the motion of a bar, may jump, held by a stiffness."""

    place: float
    stiffness: float


@dataclass(frozen=True, eq=False)
class OpenMesh:
    """A mesh, and the freedoms of each element: those behind a cut are further ones."""

    line: Line
    mesh: Mesh
    freedoms: np.ndarray  # (element, freedom of it)

    @property
    def count(self) -> int:
        return int(self.freedoms.max()) + 1

    def rows(self, places: Sequence[float], derivative: int = 0) -> np.ndarray:
        """Deflections of shape (place, freedom), or their derivatives."""
        rows = np.zeros((len(places), self.count))
        for row, place in zip(rows, np.ravel(places), strict=True):
            element = int(np.searchsorted(self.mesh.nodes, place, side="right")) - 1
            element = int(np.clip(element, 0, self.mesh.sizes.size - 1))
            size = self.mesh.sizes[element]
            local = (place - self.mesh.nodes[element]) / size
            row[self.freedoms[element]] = shape(self.line.kind, local, size, derivative)
        return rows


@dataclass(frozen=True, eq=False)
class LinePlant:
    """Natural angular frequencies [rad/s] and mass-normalised shapes of a line that may be cut."""

    open: OpenMesh
    natural: np.ndarray
    shapes: np.ndarray  # (freedom, mode)
    jumps: np.ndarray  # (cut, mode)

    def rows(self, places: Sequence[float], derivative: int = 0) -> np.ndarray:
        """Deflections of shape (place, mode), or their derivatives."""
        return self.open.rows(places, derivative) @ self.shapes

    def part(self, start: float, end: float, derivative: int) -> np.ndarray:
        """Rows whose squares integrate to those of a segment, times its rigidity if derived."""
        mesh, line = self.open.mesh, self.open.line
        inside = np.flatnonzero((mesh.nodes[:-1] > start - 1e-8) & (mesh.nodes[1:] < end + 1e-8))
        sizes = mesh.sizes[inside]
        places = (mesh.nodes[inside] + sizes * (1 + GAUSS[:, None]) / 2).ravel()
        weights = np.tile(sizes / 2, 2) * (line.rigidity if derivative else 1.0)
        return np.sqrt(weights)[:, None] * self.rows(places, derivative)


def shape(kind: str, x: float, size: float, derivative: int) -> np.ndarray:
    """Shape functions of an element, or a derivative of them."""
    if kind == "bar":
        return (
            quadratic(x) if not derivative else np.array([4 * x - 3, 4 - 8 * x, 4 * x - 1]) / size
        )
    if derivative < 2:
        return (deflection, slope)[derivative](x, size, 0.0)
    return np.array([12 * x - 6, size * (6 * x - 4), 6 - 12 * x, size * (6 * x - 2)]) / size**2


@lru_cache(maxsize=16)
def line_plant(
    line: Line, cuts: tuple[Cut, ...], nodes: tuple[float, ...], elements: int
) -> LinePlant:
    """Modes of the line with its cuts, whose mesh has nodes at these places."""
    mesh = mesh_with(line, (*nodes, *(cut.place for cut in cuts)), elements)
    open_mesh, jumps = opened(line, mesh, cuts)
    stiffness, mass = assembled(open_mesh)
    for jump, cut in zip(jumps, cuts, strict=True):
        stiffness += cut.stiffness * np.outer(jump, jump)
    free = sorted(set(range(len(mass))) - held(line, NOTHING, mesh))
    squares, free_shapes = scipy.linalg.eigh(
        stiffness[np.ix_(free, free)], mass[np.ix_(free, free)]
    )
    shapes = np.zeros((len(mass), squares.size))
    shapes[free] = free_shapes
    return LinePlant(open_mesh, np.sqrt(np.maximum(squares, 0.0)), shapes, jumps @ shapes)


def mesh_with(line: Line, nodes: Sequence[float], elements: int) -> Mesh:
    """Even elements between nodes, and pieces of the line."""
    borders = np.linspace(0.0, line.length, max(len(line.pieces), 1) + 1)
    places = np.unique(np.round([*borders, *nodes], 9))
    pieces, middles = np.diff(places), (places[1:] + places[:-1]) / 2
    counts = np.ceil(pieces / line.length * elements - 1e-9).astype(int)
    sizes = np.repeat(pieces / counts, counts)
    uneven = np.array(line.pieces or (1.0,))[np.searchsorted(borders, middles) - 1]
    whole = np.concatenate([[0.0], np.cumsum(sizes)])
    rigidity = line.rigidity * np.repeat(uneven, counts)
    return Mesh(line.kind, whole, sizes, rigidity, np.zeros(sizes.size))


def opened(line: Line, mesh: Mesh, cuts: Sequence[Cut]) -> tuple[OpenMesh, np.ndarray]:
    """The mesh with a freedom more behind each cut, and the rows of the jumps."""
    width, freedom = (3, 0) if line.kind == "bar" else (4, 1)
    freedoms = 2 * np.arange(mesh.sizes.size)[:, None] + np.arange(width)
    jumps = np.zeros((len(cuts), mesh.freedoms + len(cuts)))
    for number, cut in enumerate(cuts):
        behind = int(np.argmin(np.abs(mesh.nodes - cut.place)))
        jumps[number, freedoms[behind, freedom]] = 1.0
        freedoms[behind, freedom] = mesh.freedoms + number
        jumps[number, mesh.freedoms + number] = -1.0
    return OpenMesh(line, mesh, freedoms), jumps


def assembled(of: OpenMesh) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass of all elements, the suspension and forgotten masses."""
    stiffness, mass = np.zeros((2, of.count, of.count))
    for freedoms, *section in zip(of.freedoms, of.mesh.sizes, of.mesh.rigidity, strict=True):
        own_stiffness, own_mass = element_matrices(of.line, NOTHING, *section, 0.0)
        stiffness[np.ix_(freedoms, freedoms)] += own_stiffness
        mass[np.ix_(freedoms, freedoms)] += own_mass
    for matrix, held_there in ((stiffness, of.line.suspension), (mass, of.line.masses)):
        rows = of.rows([place for place, _ in held_there])
        matrix += rows.T * np.array([size for _, size in held_there]) @ rows
    return stiffness, mass


@dataclass(frozen=True, eq=False)
class PlateWithPorts:
    """The same of a plate by Ritz's method; only deflections are its ports."""

    plate: Plate

    @property
    def natural(self) -> np.ndarray:
        return plate_plant(self.plate).natural

    def rows(self, places: Sequence[Sequence[float]], derivative: int = 0) -> np.ndarray:
        return plate_plant(self.plate).rows(places)

    def part(self, start: Sequence[float], end: Sequence[float], derivative: int) -> np.ndarray:
        """Rows whose squares integrate to 1 over a patch."""
        points, weights = np.polynomial.legendre.leggauss(PATCH)
        sides = [
            low + (high - low) * (1 + points) / 2 for low, high in zip(start, end, strict=True)
        ]
        places = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
        area = np.prod(np.subtract(end, start))
        return np.sqrt(area * np.outer(weights, weights).ravel() / 4)[:, None] * self.rows(places)


def flexibility(system, structure: Line | Plate, omega: np.ndarray) -> np.ndarray:
    """Modal flexibility 1 / (w_n^2 - w^2 + 2 i xi w_n w), of shape (mode, line)."""
    natural = system.natural[:, None]
    loss = 2j * damping_ratios(structure, natural.size)[:, None] * natural * omega
    return 1 / (natural**2 - omega**2 + loss)


def closed(
    read: np.ndarray,
    driven: np.ndarray,
    flexible: np.ndarray,
    ports: np.ndarray,
    laws: np.ndarray,
) -> np.ndarray:
    """Receptance (sensor, actuator, line) with dynamic stiffness (line, port) at ports.

    Rows are over modes. H = H_oi - H_op Z (1 + H_pp Z)^-1 H_pi.
    """

    def between(left: np.ndarray, right: np.ndarray) -> np.ndarray:
        return np.einsum("im,ml,jm->lij", left, flexible, right, optimize=True)

    direct = between(read, driven)
    if not len(ports):
        return np.moveaxis(direct, 0, -1)
    across = np.eye(len(ports)) + laws[:, :, None] * between(ports, ports)
    force = np.linalg.solve(across, laws[:, :, None] * between(ports, driven))
    return np.moveaxis(direct - between(read, ports) @ force, 0, -1)
