"""All modes of a fine mesh of a bar or beam with hidden effects.

Independent of bayes_placement.

SI units. A bar moves axially (quadratic elements), a beam in bending (Hermite cubic elements, or
with shear those of Friedman and Kosmatka, 1993, doi:10.1016/0045-7949(93)90243-7).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy.linalg

ELEMENTS = 120


@dataclass(frozen=True)
class Effect:
    """A hidden effect: its name and its parameters, in SI, as pairs so that it can be hashed."""

    name: str
    pairs: tuple[tuple[str, float | str | bool], ...]

    def __getitem__(self, parameter: str):
        return dict(self.pairs)[parameter]


def effect(name: str, **parameters: float | str | bool) -> Effect:
    return Effect(name, tuple(parameters.items()))


NOTHING = effect("nothing")


@dataclass(frozen=True)
class Line:
    """A uniform line structure: `bar` or `beam`, ends `fixed-free`, on grounded soft springs."""

    kind: str
    ends: str
    length: float
    area: float
    youngs_modulus: float
    density: float
    damping_ratio: float
    second_moment: float = 0.0  # of a beam
    suspension: tuple[tuple[float, float], ...] = ()  # place [m], stiffness [N/m]
    pieces: tuple[float, ...] = ()  # factors of the rigidity on pieces of the same length
    masses: tuple[tuple[float, float], ...] = ()  # place [m], mass [kg], of the modes themselves
    attached: tuple[tuple[float, float], ...] = ()  # the same, on a structure damped as without
    damping_factors: tuple[float, ...] = ()  # of the lowest modes; 1 for further ones

    @property
    def mass(self) -> float:
        return self.density * self.area * self.length

    @property
    def rigidity(self) -> float:
        """E A [N] or E I [N m^2]."""
        return self.youngs_modulus * (self.area if self.kind == "bar" else self.second_moment)


@dataclass(frozen=True)
class Mesh:
    """Element boundaries [m], and the section of each element."""

    kind: str
    nodes: np.ndarray
    sizes: np.ndarray
    rigidity: np.ndarray
    shear: np.ndarray  # 12 E I / (k G A h^2) of each element, 0 without shear

    @property
    def freedoms(self) -> int:
        elements = self.nodes.size - 1
        return 2 * elements + (1 if self.kind == "bar" else 2)

    def rows(self, positions: Sequence[float]) -> np.ndarray:
        """Shape functions of shape (position, freedom) that read the motion at positions [m]."""
        rows = np.zeros((len(positions), self.freedoms))
        for row, position in zip(rows, positions, strict=True):
            element = np.searchsorted(self.nodes, position, side="right") - 1
            element = int(np.clip(element, 0, self.nodes.size - 2))
            size = self.sizes[element]
            local = (position - self.nodes[element]) / size
            values = (
                quadratic(local)
                if self.kind == "bar"
                else deflection(local, size, self.shear[element])
            )
            row[2 * element : 2 * element + values.size] = values
        return rows


def quadratic(x: float) -> np.ndarray:
    return np.array([(1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)])


def deflection(x: float, size: float, shear: float) -> np.ndarray:
    """Shape functions of the deflection for (w, rotation) at both nodes; Hermite without shear."""
    half = shear / 2
    return np.array(
        [
            2 * x**3 - 3 * x**2 - shear * x + 1 + shear,
            size * (x**3 - (2 + half) * x**2 + (1 + half) * x),
            -2 * x**3 + 3 * x**2 + shear * x,
            size * (x**3 - (1 - half) * x**2 - half * x),
        ]
    ) / (1 + shear)


def slope(x: float, size: float, shear: float) -> np.ndarray:
    """Slope of the deflection."""
    half = shear / 2
    return np.array(
        [
            (6 * x**2 - 6 * x - shear) / size,
            3 * x**2 - (4 + shear) * x + 1 + half,
            (-6 * x**2 + 6 * x + shear) / size,
            3 * x**2 - (2 - shear) * x - half,
        ]
    ) / (1 + shear)


def rotation(x: float, size: float, shear: float) -> np.ndarray:
    """Shape functions of the rotation of the section."""
    return np.array(
        [
            6 * (x**2 - x) / size,
            3 * x**2 - (4 + shear) * x + 1 + shear,
            -6 * (x**2 - x) / size,
            3 * x**2 - (2 - shear) * x,
        ]
    ) / (1 + shear)


def squared(function, *section: float) -> np.ndarray:
    """Integral of f f' over the unit element, exact for cubic functions."""
    points, weights = np.polynomial.legendre.leggauss(4)
    values = [function((1 + point) / 2, *section) for point in points]
    return sum(w / 2 * np.outer(value, value) for w, value in zip(weights, values, strict=True))


def bar_element(size: float, rigidity: float) -> np.ndarray:
    return rigidity / (3 * size) * np.array([[7, -8, 1], [-8, 16, -8], [1, -8, 7]])


def beam_element(size: float, rigidity: float, shear: float) -> np.ndarray:
    near, far, arm = (4 + shear) * size**2, (2 - shear) * size**2, 6 * size
    matrix = np.array(
        [[12, arm, -12, arm], [arm, near, -arm, far], [-12, -arm, 12, -arm], [arm, far, -arm, near]]
    )
    return rigidity / (1 + shear) / size**3 * matrix


def mesh_of(line: Line, hidden: Effect, elements: int, loaded: tuple[float, ...]) -> Mesh:
    """Even elements between the places where the section changes, and those that are loaded.

    A bar has a kink where it is loaded, which needs a node; a beam is smooth there.
    """
    if hidden.name == "shear_and_rotary_inertia":
        elements = 3 * elements  # these elements converge with the square of their size
    bounds, weak = {0.0, line.length, *(loaded if line.kind == "bar" else ())}, (1.0, 0.0)
    if hidden.name == "local_stiffness_loss":
        weak = tuple(hidden["at"] + side * hidden["extent"] / 2 for side in (-1, 1))
        bounds |= set(weak)
    borders = np.linspace(0.0, line.length, max(len(line.pieces), 1) + 1)
    bounds |= set(borders[1:-1].tolist())
    places = np.array(sorted(bounds))
    pieces, middles = np.diff(places), (places[1:] + places[:-1]) / 2
    counts = np.ceil(pieces / line.length * elements - 1e-9).astype(int)
    sizes = np.repeat(pieces / counts, counts)
    inside = (middles > weak[0]) & (middles < weak[1])
    uneven = np.array(line.pieces or (1.0,))[np.searchsorted(borders, middles) - 1]
    stiffness_share = np.repeat(
        uneven * (1 - inside * (hidden["share"] if inside.any() else 0.0)), counts
    )
    shear = np.zeros(sizes.size)
    if hidden.name == "shear_and_rotary_inertia":
        shear = 12 * line.rigidity / (shear_stiffness(line, hidden) * sizes**2)
    nodes = np.concatenate([[0.0], np.cumsum(sizes)])
    return Mesh(line.kind, nodes, sizes, line.rigidity * stiffness_share, shear)


def shear_stiffness(line: Line, hidden: Effect) -> float:
    """k G A [N], G = E / (2 (1 + nu))."""
    modulus = line.youngs_modulus / (2 * (1 + hidden["poisson_ratio"]))
    return hidden["shear_correction"] * modulus * line.area


def matrices(line: Line, hidden: Effect, mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass over all freedoms, springs of suspension and support included."""
    stiffness, mass = np.zeros((2, mesh.freedoms, mesh.freedoms))
    for element, section in enumerate(zip(mesh.sizes, mesh.rigidity, mesh.shear, strict=True)):
        block = slice(2 * element, 2 * element + (3 if mesh.kind == "bar" else 4))
        own_stiffness, own_mass = element_matrices(line, hidden, *section)
        stiffness[block, block] += own_stiffness
        mass[block, block] += own_mass
    rows = mesh.rows([place for place, _ in line.suspension])
    springs = np.array([spring for _, spring in line.suspension])
    stiffness += rows.T * springs @ rows
    rows = mesh.rows([place for place, _ in line.masses])
    mass += rows.T * np.array([weight for _, weight in line.masses]) @ rows
    if hidden.name == "compliant_support":
        freedom = support(hidden, mesh)
        stiffness[freedom, freedom] += 1 / hidden["compliance"]
    return stiffness, mass


@lru_cache(maxsize=64)
def element_matrices(
    line: Line, hidden: Effect, size: float, rigidity: float, shear: float
) -> tuple[np.ndarray, np.ndarray]:
    per_length = line.density * line.area
    if line.kind == "bar":
        return bar_element(size, rigidity), per_length * size * squared(quadratic)
    stiffness = beam_element(size, rigidity, shear)
    mass = per_length * size * squared(deflection, size, shear)
    if hidden.name == "axial_preload":
        stiffness = stiffness + hidden["tension"] * size * squared(slope, size, shear)
    if hidden.name == "shear_and_rotary_inertia":
        inertia = line.density * line.second_moment
        mass = mass + inertia * size * squared(rotation, size, shear)
    return stiffness, mass


def support(hidden: Effect, mesh: Mesh) -> int:
    """Freedom that a spring holds: the motion of a bar's end, the rotation of a beam's."""
    first = 0 if mesh.kind == "bar" else 1
    return first if hidden["end"] == "left" else mesh.freedoms - 1


def held(line: Line, hidden: Effect, mesh: Mesh) -> set[int]:
    """Freedoms that do not move."""
    count = {("bar", "fixed"): 1, ("beam", "fixed"): 2, ("beam", "pinned"): 1}
    left, right = (count.get((line.kind, end), 0) for end in line.ends.split("-"))
    first = mesh.freedoms - (1 if line.kind == "bar" else 2)
    fixed = {*range(left), *range(first, first + right)}
    if hidden.name == "compliant_support":
        fixed.remove(support(hidden, mesh))
    return fixed


@dataclass(frozen=True)
class Plant:
    """All modes of the mesh: natural angular frequencies [rad/s], mass-normalised shapes."""

    mesh: Mesh
    natural: np.ndarray
    shapes: np.ndarray  # (freedom, mode)

    def rows(self, positions: Sequence[float]) -> np.ndarray:
        """Shapes at positions [m], of shape (position, mode)."""
        return self.mesh.rows(positions) @ self.shapes


def damping_ratios(structure, count: int) -> np.ndarray:
    """Damping ratio of each mode of a structure, the lowest first."""
    ratios = np.full(count, structure.damping_ratio)
    factors = structure.damping_factors[:count]
    ratios[: len(factors)] *= factors
    return ratios


STRUCTURAL = {
    "local_stiffness_loss",
    "compliant_support",
    "axial_preload",
    "shear_and_rotary_inertia",
}


def plant(
    line: Line,
    hidden: Effect = NOTHING,
    elements: int = ELEMENTS,
    loaded: Sequence[float] = (),
) -> Plant:
    """Modes of the structure proper: with its weak segment, support, preload; nothing attached."""
    structural = hidden if hidden.name in STRUCTURAL else NOTHING
    heavy = (place for place, _ in (*line.masses, *line.attached))
    nodes = (*loaded, *heavy) if line.kind == "bar" else ()
    undamped = replace(line, damping_ratio=0.0, damping_factors=())
    return _plant(undamped, structural, elements, nodes)


@lru_cache(maxsize=32)
def _plant(line: Line, hidden: Effect, elements: int, loaded: tuple[float, ...]) -> Plant:
    mesh = mesh_of(line, hidden, elements, loaded)
    stiffness, mass = matrices(line, hidden, mesh)
    free = sorted(set(range(mesh.freedoms)) - held(line, hidden, mesh))
    squares, free_shapes = scipy.linalg.eigh(
        stiffness[np.ix_(free, free)], mass[np.ix_(free, free)]
    )
    shapes = np.zeros((mesh.freedoms, squares.size))
    shapes[free] = free_shapes
    return Plant(mesh, np.sqrt(np.maximum(squares, 0.0)), shapes)
