"""Direct solutions: factors, static flexibility beside strainless motions, and receptance."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int
from scipy.linalg import cholesky, null_space, qr, solve_triangular
from scipy.sparse import block_array, csc_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from ...._shared.errors import InputError

BLOCK = 64
"""Right-hand sides that are solved together."""

BACKWARD_ERROR = 1e-12  # above which a factor without pivoting is not trusted


@dataclass(frozen=True, eq=False)
class SymmetricFactor:
    """Triangular factors of a matrix whose rows are eliminated in the order they stand in.

    SuperLU without pivoting (symmetric mode); made by `factorised`.
    """

    matrix: csc_array
    triangles: SuperLU

    def solve(self, right: Float[np.ndarray, "row *column"]) -> Float[np.ndarray, "row *column"]:
        """Solution for one or many right-hand sides, block by block."""
        if right.ndim == 1:
            return self.triangles.solve(right)
        solution = np.empty(right.shape)
        for block in blocks(right.shape[1]):
            solution[:, block] = self.triangles.solve(np.asfortranarray(right[:, block]))
        return solution

    def negative_pivots(self) -> int:
        """Number of negative eigenvalues, by Sylvester's law of inertia."""
        return int(np.count_nonzero(self.triangles.U.diagonal() < 0))

    def trustworthy(self) -> bool:
        """Tell whether no row was exchanged and the backward error is small.

        The backward error of Rigal and Gaches (1967, DOI 10.1145/321406.321416): near a natural
        frequency a solution is large, and so is its residual, however good the factor.
        """
        unpivoted = np.array_equal(self.triangles.perm_r, self.triangles.perm_c)
        right = start_vector(self.matrix.shape[0])
        solution = self.solve(right)
        residual = np.abs(self.matrix @ solution - right).max()
        size = np.abs(self.matrix).sum(axis=1).max() * np.abs(solution).max() + np.abs(right).max()
        return bool(unpivoted and residual < BACKWARD_ERROR * size)


def factorised(matrix: csc_array) -> SymmetricFactor:
    """Factor of a symmetric matrix; a zero pivot is replaced by one of rounding size."""
    try:
        return SymmetricFactor(matrix, _triangles(matrix))
    except RuntimeError:  # SuperLU: exactly singular
        size = np.abs(matrix.diagonal())
        positive = np.where(size > 0, size, size.max(initial=1e-300))
        return SymmetricFactor(
            matrix, _triangles(csc_array(matrix + 1e-14 * diags_array(positive)))
        )


def blocks(count: int) -> Iterator[slice]:
    """Ranges of columns, `BLOCK` of them at once."""
    return (slice(first, min(first + BLOCK, count)) for first in range(0, count, BLOCK))


def start_vector(size: int, seed: int = 0) -> Float[np.ndarray, "row"]:
    """A random vector, always the same."""
    return np.random.default_rng(seed).standard_normal(size)


def _triangles(matrix: csc_array) -> SuperLU:
    options = {"SymmetricMode": True}
    return splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options=options)


LEAF = 40
"""Number of nodes up to which a part is not divided further."""


def nested_dissection(
    couplings: csc_array, node: Int[np.ndarray, "row"], position: Float[np.ndarray, "node 3"]
) -> Int[np.ndarray, "row"]:
    """Order rows so that a symmetric factor fills little: each half, then what separates them.

    George, Nested dissection of a regular finite element mesh, 1973, DOI 10.1137/0710032, with the
    halves cut by coordinates. On a plate of 1e5 rows minimum degree is as fast; on a solid of
    47,000 rows it takes 1.4 times as long and solves 1.7 times slower, COLAMD 3 and 4 times.

    Couplings are symmetric and have the pattern of what is factorised; `node` is the index of the
    node of each row.
    """
    rows = np.arange(node.size)
    node_of_row = csr_array((np.ones(node.size), (rows, node)), shape=(node.size, len(position)))
    pattern = csr_array(couplings)
    graph = csr_array(node_of_row.T @ (abs(pattern) @ node_of_row))
    rank = np.empty(len(position), dtype=np.int64)
    rank[_dissected(graph, position)] = np.arange(len(position))
    return np.argsort(rank[node], kind="stable")


def _dissected(graph: csr_array, position: np.ndarray) -> np.ndarray:
    """Nodes in order; by a stack instead of recursion, filled from the back."""
    order: list[np.ndarray] = []
    waiting = [(np.arange(len(position)), True)]
    while waiting:
        nodes, divisible = waiting.pop()
        lower, upper = _halves(position[nodes]) if divisible else (nodes[:0], nodes[:0])
        if lower.size == 0:
            order.append(nodes)
            continue
        above = np.zeros(len(position))
        above[nodes[upper]] = 1.0
        separates = graph[nodes[lower]] @ above > 0
        waiting.append((nodes[lower][~separates], True))
        waiting.append((nodes[upper], True))
        waiting.append((nodes[lower][separates], False))
    return np.concatenate(order[::-1])


def _halves(position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices below and above the middle of the longest side; none where it cannot be cut."""
    none = np.empty(0, dtype=np.int64)
    if len(position) <= LEAF:
        return none, none
    along = position[:, np.argmax(np.ptp(position, axis=0))]
    middle = np.median(along)
    below = along <= middle if (along > middle).any() else along < middle
    return (np.flatnonzero(below), np.flatnonzero(~below)) if below.any() else (none, none)


Fields = Float[np.ndarray, "row field"]
Directions = Int[np.ndarray, "row"]

FORCE = 1e-11
"""Share of the stiffness met in a row, below which the force of a rigid-body field is rounding."""

RANK = 1e-9
"""Share of the largest singular value, below which fields depend on each other."""

ENERGY = 1e-14
"""Share of the energies met, below which the strain energy of any other motion is rounding."""


def geometric_fields(
    position: Float[np.ndarray, "row 3"], direction: Directions
) -> Float[np.ndarray, "row 6"]:
    """Three translations and three rotations about the centre, the largest displacement about 1.

    Directions of rows are 1 to 6 for x, y, z and the rotations about them. Others, such as the
    twist of a plate, do not take part.
    """
    arm = position - position.mean(axis=0)
    size = np.linalg.norm(arm, axis=1).max() or 1.0
    fields = np.zeros((len(position), 6))
    for axis in range(3):
        rotated = np.cross(np.eye(3)[axis], arm)
        fields[direction == axis + 1, axis] = 1.0
        fields[direction == axis + 4, 3 + axis] = 1 / size
        for along in range(3):
            rows = direction == along + 1
            fields[rows, 3 + axis] = rotated[rows, along] / size
    return fields


def free_fields(
    stiffness: csc_array, fields: Fields, fixed: Float[np.ndarray, "fixed field"]
) -> Float[np.ndarray, "row free"]:
    """Combinations of fields that vanish where the structure is held and need no force.

    The fields are on the rows that are not held, as the stiffness, and on those that are.
    """
    if fixed.size:
        fields = fields @ null_space(fixed, rcond=RANK)
    fields = _independent(fields)
    if not fields.shape[1]:
        return fields
    met = abs(stiffness) @ np.abs(fields).max(axis=1)
    force = (stiffness @ fields) / np.where(met > 0, met, 1.0)[:, None]
    _, _, combinations = np.linalg.svd(force, full_matrices=False)
    unforced = np.abs(force @ combinations.T).max(axis=0) <= FORCE
    return fields @ combinations.T[:, unforced]


def further_field(factor: SymmetricFactor) -> Float[np.ndarray, "row"] | None:
    """Motion without strain energy that a factorised stiffness still allows, such as a hinge's.

    Inverse iteration converges to it at once; None if its result is strained.
    """
    motion = start_vector(factor.matrix.shape[0])
    for _ in range(2):
        motion = factor.solve(motion / np.abs(motion).max())
    motion /= np.abs(motion).max()
    energy = motion @ (factor.matrix @ motion)
    met = np.abs(motion) @ (abs(factor.matrix) @ np.abs(motion))
    return motion if abs(energy) <= ENERGY * met else None


def pins(fields: Fields, direction: Directions) -> Int[np.ndarray, "pin"]:
    """Rows that hold the fields: one for each, translations where these suffice."""
    if not fields.shape[1]:
        return np.empty(0, dtype=np.int64)
    # A rotation may have almost no stiffness (drilling of a shell): held there, all would swing.
    weight = np.where(direction <= 3, 1.0, 1e-4)
    _, _, order = qr((fields * weight[:, None]).T, mode="economic", pivoting=True)
    return np.sort(order[: fields.shape[1]])


def _independent(fields: np.ndarray) -> np.ndarray:
    """Fields without those that vanish or depend on others."""
    left_vectors, size, _ = np.linalg.svd(fields, full_matrices=False)
    return left_vectors[:, size > RANK * max(size.max(initial=0.0), 1e-300)]


MECHANISMS = 12
"""Motions without strain energy that may exist besides those of a rigid body."""

MASSLESS = 1e-12  # of the largest inertia of a field, below which a field counts as massless


@dataclass(frozen=True, eq=False)
class StaticFlexibility:
    r"""Flexibility of all elastic modes: K^-1 for a held structure, A^T K^+ A for a free one.

    Where rigid-body fields R (R^T M R = 1) are left, the load is made self-balanced by inertia,
    A = 1 - M R R^T, as many rows as fields are pinned, which then carry no force, and the fields
    are removed from the displacement: inertia relief (Geradin & Rixen, Mechanical Vibrations,
    2015, section 3.4). It is the pseudo-inverse with respect to the mass, and no rigid-body mode
    is left in it even by rounding.
    """

    stiffness: csc_array
    mass: csc_array
    """Matrices on the rows that may move, in an order of elimination that fills little."""
    fields: Fields
    """Mass-orthonormal motions without strain energy."""
    pins: Int[np.ndarray, "pin"]
    """Rows that hold them."""
    factor: SymmetricFactor
    """Factor of the stiffness without the pinned rows."""

    def __call__(self, force: Float[np.ndarray, "row *column"]) -> Float[np.ndarray, "row *column"]:
        """Displacement [m] under forces [N], orthogonal to the rigid-body fields."""
        if not self.pins.size:
            return self.factor.solve(force)
        moving = self.moving
        displacement = np.zeros(force.shape)
        displacement[moving] = self.factor.solve(self.balanced(force)[moving])
        return displacement - self.fields @ (self.fields.T @ (self.mass @ displacement))

    def balanced(self, force: Float[np.ndarray, "row *column"]) -> Float[np.ndarray, "row *column"]:
        """Force less the inertia of the rigid-body motion that it causes."""
        return force - self.mass @ (self.fields @ (self.fields.T @ force))

    @property
    def moving(self) -> Int[np.ndarray, "moving"]:
        """Rows that are not pinned."""
        return np.setdiff1d(np.arange(self.mass.shape[0]), self.pins)

    def between(
        self, rows: Int[np.ndarray, "response"], columns: Int[np.ndarray, "reference"], power: int
    ) -> Float[np.ndarray, "response reference"]:
        """Sum of phi phi / omega_n^(2 power) between chosen rows, by blocks of columns."""
        flexibility = np.empty((rows.size, columns.size))
        for block in blocks(columns.size):
            unit = np.zeros((self.mass.shape[0], columns[block].size))
            unit[columns[block], np.arange(unit.shape[1])] = 1.0
            displacement = self(unit)
            for _ in range(power - 1):
                displacement = self(self.mass @ displacement)
            flexibility[:, block] = displacement[rows]
        return flexibility

    def changed(self, stiffness: csc_array, mass: csc_array) -> "StaticFlexibility":
        """Return the same for other matrices, with the same motions free of strain energy."""
        fields = mass_orthonormal(self.fields, mass)
        factor = factorised(_among(stiffness, self.moving))
        return StaticFlexibility(stiffness, mass, fields, self.pins, factor)


def static_flexibility(
    stiffness: csc_array, mass: csc_array, fields: Fields, direction: Int[np.ndarray, "row"]
) -> StaticFlexibility:
    """Factorise a stiffness once the motions without strain energy are pinned."""
    for _ in range(MECHANISMS + 1):
        fields = mass_orthonormal(fields, mass)
        pinned = pins(fields, direction)
        moving = np.setdiff1d(np.arange(direction.size), pinned)
        factor = factorised(_among(stiffness, moving))
        further = further_field(factor)
        if further is None:
            return StaticFlexibility(stiffness, mass, fields, pinned, factor)
        field = np.zeros((direction.size, 1))
        field[moving, 0] = further
        fields = np.hstack([fields, field])
    raise InputError(
        f"The stiffness allows more than {MECHANISMS} motions without strain energy besides those "
        "of a rigid body; hardly any structure has so many hinges. Look for parts that nothing "
        "joins, rows without stiffness, or a stiffness in the wrong units."
    )


def mass_orthonormal(fields: Fields, mass: csc_array) -> Fields:
    """Fields of modal mass 1 and without coupling by mass, each with its largest entry positive."""
    if not fields.shape[1]:
        return fields
    fields = fields / np.abs(fields).max(axis=0)
    inertia = fields.T @ (mass @ fields)
    if np.linalg.eigvalsh(inertia)[0] <= MASSLESS * np.trace(inertia):
        raise InputError(
            "The structure has a motion with neither strain energy nor mass; every free motion "
            "needs one of them, since its response is infinite otherwise. Hold it with fixed=, "
            "or give it inertia."
        )
    factor = cholesky(inertia, lower=True)
    return with_sign(solve_triangular(factor, fields.T, lower=True).T)


def with_sign(shape: Float[np.ndarray, "row mode"]) -> Float[np.ndarray, "row mode"]:
    """Shapes whose largest entry is positive; of several equal ones, to rounding, the first."""
    size = np.abs(shape)
    first = np.argmax(size >= (1 - 1e-6) * size.max(axis=0), axis=0)
    return shape * np.sign(shape[first, np.arange(shape.shape[1])])


def _among(matrix: csc_array, rows: np.ndarray) -> csc_array:
    return csc_array(matrix[rows][:, rows]) if rows.size < matrix.shape[0] else matrix


PIVOT_THRESHOLD = 1e-3
"""Share of the largest entry of its column, below which a pivot is exchanged."""


class ModalDamping(NamedTuple):
    """Viscous damping U diag(2 zeta omega_n) U^T of some modes, U = M Phi."""

    momentum: Float[np.ndarray, "row mode"]
    rate: Float[np.ndarray, "mode"]


def receptance(
    stiffness: csc_array,
    mass: csc_array,
    damping: ModalDamping,
    read: Float[np.ndarray, "row response"],
    driven: Float[np.ndarray, "row reference"],
    omega: Float[np.ndarray, "frequency"],
) -> Complex[np.ndarray, "response reference frequency"]:
    """Receptance [m/N] between forces and displacements.

    Modal damping couples all rows. The modal displacements y = U^T x are therefore kept as
    unknowns, so that the equations stay sparse but for their border.

    The stiffness has its loss factor. `read` and `driven` are the weights of the rows in each
    displacement, and of each force on the rows; omega is in rad/s.
    """
    modes = damping.rate.size
    right = np.vstack([driven, np.zeros((modes, driven.shape[1]))]).astype(complex)
    receptance = np.empty((read.shape[1], driven.shape[1], omega.size), dtype=complex)
    for line, angular in enumerate(omega):
        matrix = _bordered(stiffness - angular**2 * mass, damping, angular)
        # The order of the rows fills little, the border is last; few rows need to be exchanged.
        solution = splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=PIVOT_THRESHOLD).solve(
            right
        )
        receptance[..., line] = read.T @ solution[: len(driven)]
    return receptance


def _bordered(dynamic: csc_array, damping: ModalDamping, omega: float) -> csc_array:
    if not damping.rate.size:
        return csc_array(dynamic, dtype=complex)
    force = csc_array(1j * omega * damping.momentum * damping.rate)
    identity = diags_array(np.ones(damping.rate.size))
    return csc_array(block_array([[dynamic, force], [csc_array(damping.momentum.T), -identity]]))
