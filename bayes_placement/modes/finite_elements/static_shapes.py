"""Static shapes of the parts of a model that may become flexible, next to its modes.

A support moves by its constraint modes (Craig & Bampton, 1968, DOI 10.2514/3.4741), a joint turns
by the attachment mode of its moment, a region or a member flows by those of the strains it loses.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from scipy.linalg import block_diag, cholesky, eigh, solve_triangular

from ...positions.channel import printable_name
from .loose_joints import Joint
from .matrices import Matrices, Sparse
from .modal_model import ModalModel
from .soft_supports import SupportMotion

Members = Mapping[str, Sparse]
Supports = Mapping[str, SupportMotion]
Joints = Mapping[str, Joint]

MAX_PATTERNS = 32
"""Patterns of one part; finer ones matter far above the band only."""

LOST_SHARES, TENSION_SHARES = (0.9,), (-5.0, 0.7)
"""Shares of the stiffness of a region, and of the buckling load of a member, that are taken away
to find the strains that matter once it has changed much."""

LOW, MIN_LOW_MODES = 0.5, 6
"""Share of the highest natural frequency up to which modes tell the strains of a region."""

SUPPORT_MOTIONS = 4
"""Motions of a support whose strains in regions and members are included."""

_INVERSE_ITERATIONS = 2  # towards the modes of a weakened structure
_NO_REACTION = 1e-6  # of what the inertia resists, below which a reaction is rounding
_ROUNDING = 1e-12  # of the greatest energy or of its whole mass, below which a shape has none

Square = Float[np.ndarray | Array, "pattern pattern"]
Patterns = Float[np.ndarray, "pattern pattern"]
Shapes = Float[np.ndarray, "dof pattern"]


class StaticShapes(eqx.Module):
    """Static shapes Psi of the flexible parts of a structure, next to its modes Phi.

    The parts are supports, joints, regions that lose stiffness, members under tension, in this
    order. All have the same number of patterns, side by side; zeros fill up. The residual shapes
    are Psi less their part in Phi; combined to X they are, within each part, mass-orthonormal and
    of diagonal flexibility.
    """

    shape: Float[np.ndarray | Array, "row pattern"]
    """Residual shapes at the rows that are read."""
    participation: Float[np.ndarray | Array, "mode pattern"]
    """Phi^T M Psi."""
    orthonormal: Square
    """Combinations of the residual shapes that are X [kg^-1/2]."""
    residual_participation: Square
    """X^T M Psi."""
    mass: Square
    """X^T M X: 1 within a part."""
    flexibility: Square
    """X^T M K^-1 M X [s^2]."""
    reaction: Square
    """Stiffness of the structure against the patterns, over that of a unit spring in them."""
    tension: Float[np.ndarray | Array, "member"]
    """Tension [N] of each member at which its geometric stiffness is such a spring."""
    supports: tuple[str, ...] = eqx.field(static=True, default=())
    joints: tuple[str, ...] = eqx.field(static=True, default=())
    regions: tuple[str, ...] = eqx.field(static=True, default=())
    members: tuple[str, ...] = eqx.field(static=True, default=())
    """Names."""
    compliance_units: tuple[str, ...] = eqx.field(static=True, default=())
    """Unit of the compliance of each support."""

    @property
    def compliant_parts(self) -> int:
        """Number of supports and joints, which come first."""
        return len(self.supports) + len(self.joints)

    @property
    def parts(self) -> int:
        """Number of all flexible parts; zero where their static shapes are not known."""
        return self.compliant_parts + len(self.regions) + len(self.members)

    @property
    def patterns_per_part(self) -> int:
        """Number of patterns of one part."""
        return self.shape.shape[1] // max(self.parts, 1)

    def patterns(self, parts: Int[Array, "part"]) -> Int[Array, "pattern"]:
        """Patterns of some parts, by the numbers of these."""
        per_part = self.patterns_per_part
        return (parts[:, None] * per_part + np.arange(per_part)).reshape(-1)

    def select(self, patterns: Int[Array, "chosen"]) -> "StaticShapes":
        """Only some patterns, without the names of their parts."""
        block = (patterns[:, None], patterns)
        return StaticShapes(
            shape=jnp.asarray(self.shape)[:, patterns],
            participation=jnp.asarray(self.participation)[:, patterns],
            orthonormal=jnp.asarray(self.orthonormal)[block],
            residual_participation=jnp.asarray(self.residual_participation)[block],
            mass=jnp.asarray(self.mass)[block],
            flexibility=jnp.asarray(self.flexibility)[block],
            reaction=jnp.asarray(self.reaction)[block],
            tension=jnp.zeros(0),
        )

    def least_stiffness(self, natural: float) -> Float[np.ndarray, "part"]:
        """Least stiffness of the structure against a pattern of each support, then each joint.

        A structure that follows a support without strain, such as a cantilever its clamp, resists
        by its inertia alone.

        It is that at the angular frequency of the first elastic mode [rad/s].
        """
        inertia = np.sum(np.asarray(self.participation) ** 2, axis=0)
        reaction, dynamic = np.diag(np.asarray(self.reaction)), natural**2 * inertia
        resisting = np.where(reaction > _NO_REACTION * dynamic, reaction, dynamic)
        of_parts = resisting.reshape(-1, max(self.patterns_per_part, 1))
        return np.array([part[part > 0].min() for part in of_parts[: self.compliant_parts]])


def no_static_shapes(rows: int, modes: int) -> StaticShapes:
    """No flexible parts."""
    empty = np.zeros((0, 0))
    return StaticShapes(np.zeros((rows, 0)), np.zeros((modes, 0)), *(empty,) * 5, np.zeros(0))


class LoadedShapes(NamedTuple):
    """Static shapes of one part in unit patterns, and the loads that cause them."""

    shape: Shapes
    load: Shapes
    relief: Shapes
    """Momentum that an element no longer has where its end turns against its node."""
    strained: Shapes
    """Motion of the part alone, against which it is a spring."""


def static_shapes(
    matrices: Matrices,
    model: ModalModel,
    soft: Supports,
    joints: Joints,
    members: Members,
    rows: Int[np.ndarray, "row"],
) -> StaticShapes:
    r"""Static shapes of all flexible parts of a structure, and what its modes lack of them.

    A region of stiffness K_r, of which a share q is lost, flows as if it were loaded by K_r T:
    (K - q K_r)^-1 = K^-1 + Psi C' Psi^T with Psi = K^-1 K_r T and C' = c / (1 + c S),
    c = q / (1 - q), S = T^T (K_r - K_r K^-1 K_r) T, T^T K_r T = 1. It is exact if T spans all
    strains, as it does in small models; else it spans those of the lowest modes, with the region
    intact and without most of its stiffness. A member under tension is a region that gains
    stiffness. Where the modes span every motion they say all of regions and members themselves.
    The model gives all modes up to some frequency, members their geometric stiffness under a unit
    tension [1/m]; shapes are wanted at some rows.
    """
    for name in soft:
        printable_name("A support of the name", name)
    for name in joints:
        printable_name("A joint of the name", name)
    modes = model.shape.shape[1]
    if not (soft or joints) and (modes == _free(matrices) or not (matrices.regions or members)):
        return no_static_shapes(len(rows), modes)
    parts, tension = _parts(matrices, model, soft, joints, members)
    per_part = max(part.shape.shape[1] for part in parts)
    shape, load, relief, strained = _side_by_side(parts, per_part)
    same_part = _same(range(len(parts)), per_part)
    same_element = _same(_elements(parts, soft, joints), per_part)
    participation = model.shape.T @ (matrices.mass @ shape - relief)
    residual = shape - model.shape @ participation
    momentum = matrices.mass @ residual - relief
    inertia = same_element * (strained.T @ relief)
    mass = residual.T @ momentum - relief.T @ residual + inertia
    flexibility = momentum.T @ matrices.displacement(momentum)
    whole = np.diag(mass) + np.sum(participation**2, axis=0)
    orthonormal = _orthonormal(mass, whole, flexibility, per_part)
    flexible = orthonormal.T @ flexibility @ orthonormal
    return StaticShapes(
        shape=residual[rows],
        participation=participation,
        orthonormal=orthonormal,
        residual_participation=orthonormal.T @ mass,
        mass=np.where(same_part, np.eye(len(same_part)), orthonormal.T @ mass @ orthonormal),
        flexibility=np.where(same_part, np.diag(np.diag(flexible)), flexible),
        reaction=_reaction(matrices, shape, load) + same_element * (strained.T @ load),
        tension=tension,
        supports=tuple(soft),
        joints=tuple(joints),
        regions=tuple(matrices.regions),
        members=tuple(members),
        compliance_units=tuple(motion.compliance_unit for motion in soft.values()),
    )


def _parts(
    matrices: Matrices, model: ModalModel, soft: Supports, joints: Joints, members: Members
) -> tuple[list[LoadedShapes], Float[np.ndarray, "member"]]:
    """Shapes of each support, joint, region and member, and buckling loads of members [N]."""
    unit = _of_unit_energy(model)
    tension = np.array([_buckling_load(unit, member) for member in members.values()])
    stretched = [load * member for load, member in zip(tension, members.values(), strict=True)]
    parts = [_constraint_modes(matrices, model, support) for support in soft.values()]
    supports = [_support_motions(matrices, support.shape) for support in parts]
    parts += [_attachment_mode(matrices, joint) for joint in joints.values()]
    regions = [(region, LOST_SHARES) for region in matrices.regions.values()]
    small = _free(matrices) <= MAX_PATTERNS
    motions = _every_motion(matrices) if small else _lowest(model, unit)
    for stiffness, shares in [*regions, *((member, TENSION_SHARES) for member in stretched)]:
        lost = [] if small else [share * stiffness for share in shares]
        changed = [_weakened(matrices, part, motions) for part in lost]
        parts.append(_attachment_modes(matrices, stiffness, [motions, *changed, *supports]))
    return parts, tension


def _free(matrices: Matrices) -> int:
    """Number of rows that may move."""
    return len(matrices.dof) - len(matrices.fixed)


def _every_motion(matrices: Matrices) -> Shapes:
    """Independent motions that span every one with strain, each with an energy of one half."""
    unit = np.delete(np.eye(len(matrices.dof)), matrices.fixed, axis=1)
    flexibility = unit.T @ matrices.displacement(unit)
    size = np.sqrt(np.diag(flexibility))
    size = np.where(size > 0, size, 1.0)  # rotations and displacements, each in a unit of its own
    energy, shape = np.linalg.eigh(flexibility / (size[:, None] * size))
    strained = energy > _ROUNDING * energy[-1]
    return unit @ (size[:, None] * shape[:, strained] * np.sqrt(energy[strained]))


def _of_unit_energy(model: ModalModel) -> Shapes:
    """Shapes of the elastic modes, each with a strain energy of one half."""
    elastic = slice(model.rigid_body_modes, None)
    return model.shape[:, elastic] / (2 * np.pi * model.natural_frequency[elastic])


def _lowest(model: ModalModel, unit: Shapes) -> Float[np.ndarray, "dof lowest"]:
    """Shapes of the lowest modes, each weighted by its period."""
    natural = model.natural_frequency[model.rigid_body_modes :]
    count = max(np.count_nonzero(natural <= LOW * natural.max(initial=0.0)), MIN_LOW_MODES)
    return unit[:, :count] * (natural[:1] / natural[:count])


def _buckling_load(unit: Shapes, member: Sparse) -> float:
    """Least compression of one member at which the structure loses its stiffness [N]."""
    greatest = float(np.linalg.eigvalsh(unit.T @ (member @ unit))[-1])
    return 1 / greatest if greatest > 0 else 1.0


def _constraint_modes(matrices: Matrices, model: ModalModel, soft: SupportMotion) -> LoadedShapes:
    """Motions of a support in which its reactions are uncoupled, the softest first."""
    release = matrices.release(soft.rows, model)
    reaction = soft.motion.T @ release.stiffness @ soft.motion
    patterns = eigh(reaction, soft.pattern)[1][:, :MAX_PATTERNS]
    shape = release.shape @ (soft.motion @ patterns)
    return LoadedShapes(shape, *np.zeros((3, *shape.shape)))


def _attachment_mode(matrices: Matrices, joint: Joint) -> LoadedShapes:
    """Displacement under the moment of a joint that turns by one radian."""
    load, relief, turn = (of[:, None] for of in (joint.moment, joint.momentum, joint.turn))
    return LoadedShapes(matrices.displacement(load), load, relief, turn)


def _support_motions(matrices: Matrices, shape: Shapes) -> Float[np.ndarray, "dof motion"]:
    """Softest motions of a support that strain the structure, each with an energy of one half."""
    softest = shape[:, :SUPPORT_MOTIONS]
    energy = np.einsum("ij,ij->j", softest, matrices.stiffness @ softest)
    strained = energy > _ROUNDING * energy.max()
    return softest[:, strained] / np.sqrt(energy[strained])


def _attachment_modes(
    matrices: Matrices, region: Sparse, motions: Sequence[np.ndarray]
) -> LoadedShapes:
    """Displacement under the stresses of motions in a region, those of most energy first."""
    fields = np.hstack(motions)
    stress = region @ fields
    energy, patterns = np.linalg.eigh(fields.T @ stress)
    most = slice(None, -MAX_PATTERNS - 1, -1)
    strained = energy[most] > _ROUNDING * energy[-1]
    unit = patterns[:, most][:, strained] / np.sqrt(energy[most][strained])
    load = stress @ unit
    return LoadedShapes(matrices.displacement(load), load, 0 * load, fields @ unit)


def _weakened(matrices: Matrices, lost: Sparse, start: Shapes) -> Shapes:
    """Approximate lowest modes of the structure without some stiffness, of unit energy."""
    shape, displacement = start, matrices.without(lost)
    for _ in range(_INVERSE_ITERATIONS):
        shape = displacement(matrices.mass @ shape)
        factor = cholesky(shape.T @ (matrices.stiffness @ shape), lower=True)
        shape = solve_triangular(factor, shape.T, lower=True).T
    return shape


def _side_by_side(parts: Sequence[LoadedShapes], per_part: int) -> LoadedShapes:
    """Patterns of all parts, as many of each."""
    sides = zip(*parts, strict=True)
    return LoadedShapes(*(np.hstack([_padded(part, per_part) for part in side]) for side in sides))


def _same(numbers: Sequence[int], per_part: int) -> Bool[np.ndarray, "pattern pattern"]:
    """Tell which patterns are of parts of the same number."""
    of_patterns = np.repeat(numbers, per_part)
    return np.equal.outer(of_patterns, of_patterns)


def _elements(parts: Sequence[LoadedShapes], soft: Supports, joints: Joints) -> list[int]:
    """Number of each part, the same of joints of one element: these are coupled by it."""
    ends = [{joint.node, joint.other} for joint in joints.values()]
    numbers = list(range(len(parts)))
    numbers[len(soft) : len(soft) + len(ends)] = [len(soft) + ends.index(pair) for pair in ends]
    return numbers


def _reaction(matrices: Matrices, shape: Shapes, load: Shapes) -> Patterns:
    """Stiffness against the patterns, but of the parts themselves."""
    work = shape.T @ load
    return shape.T @ (matrices.stiffness @ shape) - work - work.T


def _orthonormal(
    mass: Patterns, whole: Float[np.ndarray, "pattern"], flexibility: Patterns, per_part: int
) -> Patterns:
    """Combinations within each part of unit mass and diagonal flexibility, softest first.

    What the modes leave of a pattern counts in shares of the mass of the whole pattern: where they
    leave nothing it is rounding, which is no motion of the structure.
    """
    size = np.sqrt(np.where(whole > 0, whole, 1.0))
    blocks = []
    for first in range(0, len(mass), per_part):
        block = slice(first, first + per_part)
        share, vectors = np.linalg.eigh(mass[block, block] / (size[block, None] * size[block]))
        left = share > _ROUNDING
        unit = vectors[:, left] / np.sqrt(share[left]) / size[block, None]
        softest_first = np.linalg.eigh(unit.T @ -flexibility[block, block] @ unit)[1]
        blocks.append(_padded(unit @ softest_first, per_part))
    return block_diag(*blocks)


def _padded(
    shape: Float[np.ndarray, "row pattern"], per_part: int
) -> Float[np.ndarray, "row per_part"]:
    return np.pad(shape, ((0, 0), (0, per_part - shape.shape[1])))
