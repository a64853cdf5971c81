"""Motions without strain energy: of a rigid body, of hinges, of loose parts."""

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import null_space, qr
from scipy.sparse import csc_array

from ._symmetric_factor import SymmetricFactor, start_vector

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
