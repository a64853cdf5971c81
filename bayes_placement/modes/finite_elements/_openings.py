"""_openings: in, matrices, modes, what may give way in them; out, its static shapes.

Not known here: how softly it gives way, how shapes are read between nodes, probability.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import block_diag, cholesky, eigh, solve_triangular

from .matrices import Matrices, Sparse
from .modal_model import ModalModel
from .soft_supports import SupportMotion
from .static_shapes import StaticShapes, none

MOST_PATTERNS = 32
"""Patterns of one part; finer ones are felt far above the band only."""

WEAK, TENSE = (0.9,), (-5.0, 0.7)
"""Shares of its stiffness without which a region shows how it yields, and a member that buckles
the structure without all of its own."""

LOW, FEWEST = 0.5, 6
"""Share of the highest natural frequency up to which modes tell how a region yields."""

FEW = 4
"""Motions of a support under which regions and members show how they yield."""

_STEPS = 2  # of inverse iteration towards the modes of a weakened structure
_NOTHING = 1e-12  # of the greatest mass or energy, below which there is none

Patterns = Float[np.ndarray, "pattern pattern"]
Shapes = Float[np.ndarray, "dof pattern"]


class Opening(NamedTuple):
    """Static shapes of a part that gives way in unit patterns, and the loads that cause them."""

    shape: Shapes
    load: Shapes


def static_shapes(
    matrices: Matrices,
    model: ModalModel,
    soft: Mapping[str, SupportMotion],
    members: Mapping[str, Sparse],
    rows: Int[np.ndarray, "row"],
) -> StaticShapes:
    r"""Static shapes of all that may give way in a structure, and what its modes lack of them.

    A support moves by itself, the structure with it: constraint modes (Craig & Bampton, 1968,
    DOI 10.2514/3.4741). A region of stiffness K_r, of which a share q is lost, flows as if it
    were loaded by K_r T: (K - q K_r)^-1 = K^-1 + Psi C' Psi^T with Psi = K^-1 K_r T and
    C' = c / (1 + c S), c = q / (1 - q), S = T^T (K_r - K_r K^-1 K_r) T, T^T K_r T = 1. It is exact
    if T spans all strains; here it spans those of the lowest modes, with the region whole and
    without most of its stiffness. A member under tension is a region that gains stiffness.

    Parameters
    ----------
    matrices
        The model, with its regions.
    model
        Its lowest modes, all up to some frequency.
    soft
        Supports, by name.
    members
        Geometric stiffness of members under a unit tension [1/m], by name.
    rows
        Rows at which shapes are wanted.

    Raises
    ------
    ValueError
        If a row of a support is not held, or it can move as a rigid body.
    """
    unit = _of_unit_energy(model)
    low = _lowest(model, unit)
    tension = np.array([_buckling_load(unit, one) for one in members.values()])
    stretched = [load * one for load, one in zip(tension, members.values(), strict=True)]
    openings = [_of_support(matrices, model, one) for one in soft.values()]
    moved = [_moved(matrices, one.shape) for one in openings]
    for parts, shares in ((matrices.regions.values(), WEAK), (stretched, TENSE)):
        for one in parts:
            changed = [_weakened(matrices, share * one, low) for share in shares]
            openings.append(_of_region(matrices, one, [low, *changed, *moved]))
    if not openings:
        return none(len(rows), model.shape.shape[1])
    each = max(one.shape.shape[1] for one in openings)
    shape, load = (np.hstack([_filled(one[side], each) for one in openings]) for side in range(2))
    participation = model.shape.T @ (matrices.mass @ shape)
    lacking = shape - model.shape @ participation
    momentum = matrices.mass @ lacking
    mass = lacking.T @ momentum
    flexibility = momentum.T @ matrices.displacement(momentum)
    turn = _turn(mass, flexibility, each)
    flexible = turn.T @ flexibility @ turn
    own = np.kron(np.eye(len(openings)), np.ones((each, each))) > 0
    return StaticShapes(
        shape=lacking[rows],
        participation=participation,
        turn=turn,
        share=turn.T @ mass,
        mass=np.where(own, np.eye(len(own)), turn.T @ mass @ turn),
        flexibility=np.where(own, np.diag(np.diag(flexible)), flexible),
        reaction=_reaction(matrices, Opening(shape, load)),
        tension=tension,
        supports=tuple(soft),
        regions=tuple(matrices.regions),
        members=tuple(members),
    )


def _of_unit_energy(model: ModalModel) -> Shapes:
    """Shapes of the elastic modes, each with a strain energy of one half."""
    elastic = slice(model.rigid_body_modes, None)
    return model.shape[:, elastic] / (2 * np.pi * model.natural_frequency[elastic])


def _lowest(model: ModalModel, unit: Shapes) -> Float[np.ndarray, "dof lowest"]:
    """Those of the lowest modes, each weighed by its period."""
    natural = model.natural_frequency[model.rigid_body_modes :]
    count = max(np.count_nonzero(natural <= LOW * natural.max(initial=0.0)), FEWEST)
    return unit[:, :count] * (natural[:1] / natural[:count])


def _buckling_load(unit: Shapes, member: Sparse) -> float:
    """Least compression of one member at which the structure loses its stiffness [N]."""
    greatest = float(np.linalg.eigvalsh(unit.T @ (member @ unit))[-1])
    return 1 / greatest if greatest > 0 else 1.0


def _of_support(matrices: Matrices, model: ModalModel, soft: SupportMotion) -> Opening:
    """Patterns that part the reactions of a support, the softest first."""
    release = matrices.release(soft.rows, model)
    reaction = soft.motion.T @ release.stiffness @ soft.motion
    patterns = eigh(reaction, soft.pattern)[1][:, :MOST_PATTERNS]
    shape = release.shape @ (soft.motion @ patterns)
    return Opening(shape, np.zeros(shape.shape))


def _moved(matrices: Matrices, shape: Shapes) -> Float[np.ndarray, "dof few"]:
    """Softest motions of a support that strain the structure, each with an energy of one half."""
    few = shape[:, :FEW]
    energy = np.einsum("ij,ij->j", few, matrices.stiffness @ few)
    strained = energy > _NOTHING * energy.max()
    return few[:, strained] / np.sqrt(energy[strained])


def _of_region(matrices: Matrices, region: Sparse, several: Sequence[np.ndarray]) -> Opening:
    """Strains of some motions in a region, those that store most energy first."""
    fields = np.hstack(several)
    stress = region @ fields
    energy, patterns = np.linalg.eigh(fields.T @ stress)
    most = slice(None, -MOST_PATTERNS - 1, -1)
    felt = energy[most] > _NOTHING * energy[-1]
    load = stress @ (patterns[:, most][:, felt] / np.sqrt(energy[most][felt]))
    return Opening(matrices.displacement(load), load)


def _weakened(matrices: Matrices, lost: Sparse, start: Shapes) -> Shapes:
    """Lowest modes of the structure without some stiffness, nearly; together of unit energy."""
    found, displacement = start, matrices.without(lost)
    for _ in range(_STEPS):
        found = displacement(matrices.mass @ found)
        factor = cholesky(found.T @ (matrices.stiffness @ found), lower=True)
        found = solve_triangular(factor, found.T, lower=True).T
    return found


def _reaction(matrices: Matrices, opening: Opening) -> Patterns:
    """Stiffness against the patterns, in units of their own springs; a region is a spring too."""
    flown = opening.shape.T @ opening.load
    springs = np.diag((opening.load != 0).any(axis=0).astype(float))
    return springs + opening.shape.T @ (matrices.stiffness @ opening.shape) - flown - flown.T


def _turn(mass: Patterns, flexibility: Patterns, each: int) -> Patterns:
    """Combinations within each part of unit mass and diagonal flexibility, softest first."""
    turns = []
    for first in range(0, len(mass), each):
        block = slice(first, first + each)
        values, vectors = np.linalg.eigh(mass[block, block])
        there = values > _NOTHING * values[-1]
        unit = vectors[:, there] / np.sqrt(values[there])
        softest = np.linalg.eigh(unit.T @ -flexibility[block, block] @ unit)[1]
        turns.append(_filled(unit @ softest, each))
    return block_diag(*turns)


def _filled(shape: Float[np.ndarray, "row some"], each: int) -> Float[np.ndarray, "row each"]:
    return np.pad(shape, ((0, 0), (0, each - shape.shape[1])))
