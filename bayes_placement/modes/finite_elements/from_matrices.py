"""Modes from stiffness and mass matrices; everything sparse is solved here, once."""

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csc_array
from threadpoolctl import threadpool_limits

from ..._shared.arguments import arguments_checked, check_positive
from ..._shared.compiled import of_jax
from ..._shared.dimensions import Parameter
from ..._shared.errors import InputError
from ..._shared.sites import is_open
from ...positions.channel import checked_name
from ...positions.tolerances import Tolerance
from ...positions.vectors import CartesianComponents, triple
from . import _part_factors
from ._part_factors import NamedMatrices, Powers, Range, cell_masses
from .affine_modes import AffineModes
from .interpolation import Interpolation
from .loose_joints import MOST_JOINTS, MOST_NODES, Joint
from .loose_joints import joints as joints_of
from .matrices import Affine, Matrices, ReducedBasis, Sparse
from .matrices._matrix_checks import sparse
from .modal_model import ModalModel
from .nodal_modes import NodalModes, modes_from_shapes
from .soft_supports import SupportMotion
from .static_shapes import static_shapes

OverModes = Float[np.ndarray, "mode mode"]

Rows = Int[np.ndarray, "row"]

MAX_ROWS = 6000
"""Rows between which the static flexibility is kept: a dense matrix of 300 MB."""


@arguments_checked
@threadpool_limits.wrap(limits=1)  # small products: BLAS threads would only wait for each other
def modes(
    matrices: Matrices,
    interpolation: Interpolation,
    *,
    up_to: float,
    pieces: Sequence[Tolerance] = (),
    members: Mapping[str, object] | None = None,
    soft: Mapping[str, SupportMotion] | None = None,
    joints: Mapping[str, Joint] | None = None,
    youngs_modulus: Parameter = 1.0,
    density: Parameter = 1.0,
    nominal: tuple[float, float] = (1.0, 1.0),
) -> NodalModes:
    """Modes of a finite element model, with the static flexibility of those left out.

    With it, modes up to ten times the band give the receptance of frames and plates within 0.5 %
    away from antiresonances, and up to six times within 2 %.

    Parameters
    ----------
    matrices
        Stiffness and mass.
    interpolation
        How shapes are read between nodes, for example `interpolation.frame(matrices, elements)`.
        A large model is read only where it matters: `interpolation.near(position, radius)`.
    up_to
        All modes up to this frequency are kept [Hz].
    pieces
        Members and surfaces of the structure, `positions.Member` or `positions.Patch`: where
        effects may sit. By default the box around all nodes, read at the closest position.
    members
        Geometric stiffness of each member under a unit tension [1/m], by name: sparse matrices,
        `interpolation.frame_geometric_stiffness`. Needed by `effects.axial_preload`.
    soft
        Supports that may become soft, by name, `soft_supports.rotations(matrices, node)` or
        `soft_supports.edge`. Needed by `effects.compliant_support`.
    joints
        Joints that may be loose, by name. By default those of `finite_elements.joints(matrices)`
        without those in `soft`, if they are at most 60 and `matrices` names no regions; `{}` for
        none. Needed by `effects.loose_joint`.
    youngs_modulus, density
        Young's modulus [Pa] and density [kg/m3] of the entire structure, numbers or distributions;
        by default relative to the matrices [1].
    nominal
        Their values in the matrices.

    Returns
    -------
    NodalModes
        Modes of a structure, with the static correction of all modes above `up_to`.

    Raises
    ------
    InputError
        If more rows are read than a dense flexibility can hold, or the matrices have no mode
        that low.

    Examples
    --------
    >>> modes = bp.finite_elements.modes(matrices, reading, up_to=500.0)
    >>> np.asarray(modes.natural_frequency[:2]).round(3)
    array([ 9.011, 56.532])
    """
    _check_rows(interpolation)
    check_positive("up_to", up_to, "finite_elements.modes(..., up_to=2000.0)")
    return _nodal(
        matrices,
        interpolation,
        matrices.modes(up_to=up_to),
        pieces=pieces,
        members=members or {},
        soft=soft or {},
        joints=_joints(matrices, soft or {}) if joints is None else joints,
        youngs_modulus=youngs_modulus,
        density=density,
        nominal=nominal,
    )


@arguments_checked
@threadpool_limits.wrap(limits=1)
def affine(
    matrices: Matrices,
    interpolation: Interpolation,
    *,
    parameters: Mapping[str, Parameter],
    stiffness: Mapping[str, Sparse] | None = None,
    mass: Mapping[str, Sparse] | None = None,
    powers: Powers | None = None,
    ranges: Mapping[str, Range] | None = None,
    up_to: float,
    tolerance: float = 1e-3,
    pieces: Sequence[Tolerance] = (),
    members: Mapping[str, object] | None = None,
    youngs_modulus: Parameter = 1.0,
    density: Parameter = 1.0,
    nominal: tuple[float, float] = (1.0, 1.0),
) -> AffineModes:
    """Modes of a finite element model, parts of which are scaled by parameters.

    A fixed basis is extended until the natural frequencies are accurate over the entire prior; see
    `Matrices.reduced_basis`. `AffineModes.report` tells their accuracy. Give what scales the
    entire structure as `youngs_modulus` or `density`, which is exact.

    Parameters
    ----------
    matrices, interpolation
        As for `modes`.
    parameters
        Parameters over their nominal values [1], by name: numbers or distributions.
    stiffness, mass
        Matrices of parts, by name; each is contained in `matrices`. A region of `matrices` need not
        be given: a parameter of its name scales it.
    powers
        For each part the power of each parameter in its factor: `{"bending": {"thickness": 3}}`.
        By default a part is scaled by the parameter of the same name.
    ranges
        Least and greatest value of a parameter, where a number will be changed later. By default
        the range of a distribution, from its quantile 1e-4 to its quantile 1 - 1e-4.
    up_to
        Natural frequencies up to this one [Hz] are accurate; several times the band, since the
        basis contains modes up to 1.5 times this frequency and the rest is static.
    tolerance
        Largest relative error of a natural frequency.
    pieces, members, youngs_modulus, density, nominal
        As for `modes`.

    Returns
    -------
    AffineModes
        Modes that follow the parameters.

    Raises
    ------
    InputError
        If parameters and parts do not belong together, a range is not positive, the tolerance is
        not reached, or more rows are read than a dense flexibility can hold.

    Examples
    --------
    >>> root = {"root": dist.Uniform(0.5, 1.5)}
    >>> modes = bp.finite_elements.affine(matrices, reading, parameters=root, up_to=60.0)
    >>> bp.Structure(modes, damping=bp.damping.Modal(0.02))
    Structure: AffineModes, Modal damping
    """
    _check_rows(interpolation)
    _check_parameters(parameters)
    powers = powers or {}
    named = [name for name in matrices.regions if name in parameters or name in powers]
    stiffness = {name: matrices.regions[name] for name in named} | dict(stiffness or {})
    mass = dict(mass or {})
    powers = _part_factors.complete(powers, [*{**stiffness, **mass}], parameters)
    box = _part_factors.ranges(parameters, powers, ranges or {})
    basis = matrices.reduced_basis(Affine(stiffness, mass, box), up_to=up_to, tolerance=tolerance)
    nodal = _nodal(
        matrices,
        interpolation,
        _as_model(matrices, basis.basis, basis.eigenvalues),
        pieces=pieces,
        members=members or {},
        youngs_modulus=youngs_modulus,
        density=density,
        nominal=nominal,
    )
    return AffineModes(
        nodal=nodal,
        parameter=OrderedDict(parameters),
        stiffness=NamedMatrices.of(basis.stiffness, basis.eigenvalues.size),
        mass=NamedMatrices.of(basis.mass, basis.eigenvalues.size),
        residual=of_jax(_residual(matrices, interpolation.used_rows(), stiffness, basis)),
        powers=tuple((part, tuple(of_part.items())) for part, of_part in powers.items()),
        report=str(basis.report),
        frequency_error=basis.report.measured.error,
        axes=nodal.axes,
        rigid_body_modes=nodal.rigid_body_modes,
    )


def _nodal(
    matrices: Matrices,
    interpolation: Interpolation,
    model: ModalModel,
    *,
    members: Mapping[str, object],
    soft: Mapping[str, SupportMotion] | None = None,
    joints: Mapping[str, Joint] | None = None,
    **options: Any,
) -> NodalModes:
    """Nodal modes with all that follows from the matrices."""
    for name, member in members.items():
        sparse(f"members[{name!r}]", member, len(model.shape))
    rows, flexible = interpolation.used_rows(), (soft or {}, joints or {}, members)
    shapes = None if soft is None else static_shapes(matrices, model, *flexible, rows)
    return modes_from_shapes(
        model,
        interpolation,
        flexibility=matrices.static_flexibility(rows),
        regions=_over_modes(model, matrices.regions),
        cell_masses=cell_masses(matrices, model),
        members=_over_modes(model, members),
        centres=_centres(matrices, {**matrices.regions, **members}, soft or {}, joints or {}),
        static_shapes=shapes,
        mass=_mass(matrices),
        **options,
    )


def _joints(matrices: Matrices, soft: Mapping[str, SupportMotion]) -> dict[str, Joint]:
    """Joints that are tried where none are named: few, and no supports that may turn anyway."""
    if matrices.regions or len(matrices.node) > MOST_NODES:
        return {}
    softened = [matrices.dof[support.rows] for support in soft.values()]
    turning = {node for rows in softened for node, direction in rows.tolist() if direction > 3}
    found = {
        name: joint for name, joint in joints_of(matrices).items() if joint.node not in turning
    }
    return found if len(found) <= MOST_JOINTS else {}


def _over_modes(model: ModalModel, parts: Mapping[str, object]) -> dict[str, OverModes]:
    """Matrices over the modes.

    Nothing within a free structure holds it: neither a region, nor a tension with its reaction.
    """
    free = np.arange(model.shape.shape[1]) < model.rigid_body_modes
    modal = {name: model.shape.T @ (part @ model.shape) for name, part in parts.items()}
    return {name: np.where(free | free[:, None], 0.0, part) for name, part in modal.items()}


def _residual(
    matrices: Matrices, rows: Rows, parts: Mapping[str, Sparse], basis: ReducedBasis
) -> Float[np.ndarray, "part row row"]:
    """F K_i F of each part [m/N] between rows, F the static flexibility outside of the basis."""
    elastic = slice(basis.rigid_body_modes, None)
    spanned = basis.basis[rows][:, elastic] / basis.eigenvalues[elastic]
    sparse = {name: csc_array(part) for name, part in parts.items()}
    strained = np.unique(np.concatenate([rows[:0], *(part.indices for part in sparse.values())]))
    displacement = matrices.static_flexibility(strained, rows)
    residual = np.empty((len(parts), rows.size, rows.size))
    for number, (name, part) in enumerate(sparse.items()):
        in_basis = basis.stiffness[name][elastic, elastic]
        energy = displacement.T @ (part[strained][:, strained] @ displacement)
        residual[number] = energy - spanned @ in_basis @ spanned.T
    return residual


def _as_model(
    matrices: Matrices,
    shape: Float[np.ndarray, "dof vector"],
    eigenvalues: Float[np.ndarray, "vector"],
) -> ModalModel:
    """Vectors of a basis as if they were modes."""
    return ModalModel(
        node=matrices.node,
        position=matrices.position,
        dof=matrices.dof,
        shape=shape,
        natural_frequency=np.sqrt(eigenvalues) / (2 * np.pi),
    )


def _check_rows(interpolation: Interpolation) -> None:
    count = len(interpolation.used_rows())
    if count > MAX_ROWS:
        raise InputError(
            f"The interpolation reads {count} degrees of freedom; at most {MAX_ROWS} can have "
            "a static flexibility between all of them. Read only where transducers may sit: "
            "interpolation.near(position, radius)."
        )


def _check_parameters(parameters: Mapping[str, Parameter]) -> None:
    """Refuse names of several words, and numbers not above zero; ranges check distributions."""
    for name, value in parameters.items():
        checked_name("A parameter of the name", name)
        if not is_open(value):
            check_positive(f"parameters[{name!r}]", value, f"parameters={{{name!r}: 1.0}}")


def _centres(
    matrices: Matrices,
    parts: Mapping[str, Sparse],
    soft: Mapping[str, SupportMotion],
    joints: Mapping[str, Joint],
) -> dict[str, CartesianComponents]:
    """Mean of the nodes [m] of each part of the stiffness, of each support and of each joint."""
    rows = {name: part.nonzero()[0] for name, part in parts.items()}
    rows |= {name: support.rows for name, support in soft.items()}
    nodes = {name: np.isin(matrices.node, matrices.dof[of, 0]) for name, of in rows.items()}
    nodes |= {name: matrices.node == joint.node for name, joint in joints.items()}
    positions = {name: matrices.position[chosen] for name, chosen in nodes.items() if chosen.any()}
    return {name: triple(position.mean(axis=0)) for name, position in positions.items()}


def _mass(matrices: Matrices) -> float:
    """Mass that a rigid translation moves [kg]."""
    direction = int(np.min(matrices.dof[:, 1]))
    field = (matrices.dof[:, 1] == direction).astype(float)
    return float(field @ (matrices.mass @ field))
