"""finite_elements: in, stiffness and mass matrices and how to read between nodes; out, modes.

Not known here: files, damping, effects, probability. Everything sparse is solved here, once.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike
from scipy.sparse import csc_array

from ..._types import InputError, Parameter
from ...positions.tolerances import Support
from ...positions.vectors import Coordinates, triple
from . import _openings, _part_factors, _scikit_fem_rows, interpolation, nodal_modes
from ._part_factors import Powers, Range
from .affine_modes import AffineModes
from .interpolation import Interpolation
from .matrices import Matrices, Sparse
from .matrices._affine import Affine
from .matrices._reduced_basis import ReducedBasis
from .modal_model import ModalModel
from .nodal_modes import NodalModes
from .soft_supports import SupportMotion

Rows = Int[np.ndarray, "row"]

MOST_ROWS = 6000
"""Rows between which the static flexibility is kept: a dense matrix of 300 MB."""


def modes(
    matrices: Matrices,
    interpolation: Interpolation,
    *,
    up_to: float,
    pieces: Sequence[Support] = (),
    members: Mapping[str, Any] | None = None,
    soft: Mapping[str, SupportMotion] | None = None,
    youngs_modulus: Parameter = 1.0,
    density: Parameter = 1.0,
    nominal: tuple[float, float] = (1.0, 1.0),
) -> NodalModes:
    """Modes of a finite element model, with the static flexibility of all that are left out.

    With it, modes up to ten times the band are enough for 0.5 % of the receptance of frames and
    plates away from antiresonances, and up to six times for 2 %.

    Parameters
    ----------
    matrices
        Stiffness and mass.
    interpolation
        How shapes are read between nodes, `interpolation.frame(matrices, elements)` for one. A
        large model is read only where it matters: `interpolation.near(position, radius)`.
    up_to
        All modes up to this frequency are kept [Hz].
    pieces
        Supports that make up the structure, `positions.Member` or `positions.Patch`: where effects
        may sit. By default the box around all nodes, read at the closest place.
    members
        Geometric stiffness of each member under a unit tension [1/m], by name: sparse matrices,
        `interpolation.frame_geometric_stiffness`. They serve `effects.axial_preload`.
    soft
        Supports that may give way, by name, `soft_supports.rotations(matrices, node)` or
        `soft_supports.edge`. They serve `effects.compliant_support`.
    youngs_modulus, density
        Young's modulus [Pa] and density [kg/m3] of the whole structure, numbers or laws; by
        default relative ones [1].
    nominal
        Their values in the matrices.

    Raises
    ------
    ValueError
        If more rows are read than a dense flexibility can hold, or the matrices have no mode
        that low.
    """
    _check_rows(interpolation)
    return _nodal(
        matrices,
        interpolation,
        matrices.modes(up_to=up_to),
        pieces=pieces,
        members=members or {},
        soft=soft or {},
        youngs_modulus=youngs_modulus,
        density=density,
        nominal=nominal,
    )


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
    pieces: Sequence[Support] = (),
    members: Mapping[str, Any] | None = None,
    youngs_modulus: Parameter = 1.0,
    density: Parameter = 1.0,
    nominal: tuple[float, float] = (1.0, 1.0),
) -> AffineModes:
    """Modes of a finite element model some parts of which are scaled by parameters.

    A fixed basis is grown until the natural frequencies are right over the whole prior; see
    `Matrices.reduced_basis`. How right they are is told by `report` of what is returned. Give
    what scales the structure as a whole as `youngs_modulus` or `density`, which is exact.

    Parameters
    ----------
    matrices, interpolation
        As for `modes`.
    parameters
        Parameters over their nominal values [1], by name: numbers or laws.
    stiffness, mass
        Matrices of parts, by name; each is among the whole. A region of `matrices` need not be
        given: a parameter of its name scales it.
    powers
        For each part the power of each parameter in its factor: `{"bending": {"thickness": 3}}`.
        By default a part is scaled by the parameter of the same name.
    ranges
        Least and greatest value of a parameter, where a number is to be changed later. By
        default the range of a law, from its quantile 1e-4 to its quantile 1 - 1e-4.
    up_to
        Natural frequencies up to this one [Hz] are to be right; several times the band, since
        the basis goes half as far again and the rest is static.
    tolerance
        Largest relative error of a natural frequency.
    pieces, members, youngs_modulus, density, nominal
        As for `modes`.

    Raises
    ------
    ValueError
        If parameters and parts do not belong together, a range is not positive, the tolerance is
        not reached, or more rows are read than a dense flexibility can hold.
    """
    _check_rows(interpolation)
    given = powers or {}
    named = [name for name in matrices.regions if name in parameters or name in given]
    stiff = {name: matrices.regions[name] for name in named} | dict(stiffness or {})
    heavy = dict(mass or {})
    whole = _part_factors.complete(given, [*{**stiff, **heavy}], parameters)
    box = _part_factors.ranges(parameters, whole, ranges or {})
    basis = matrices.reduced_basis(Affine(stiff, heavy, box), up_to=up_to, tolerance=tolerance)
    nodal = _nodal(
        matrices,
        interpolation,
        _as_model(matrices, basis.basis, basis.squares),
        pieces=pieces,
        members=members or {},
        youngs_modulus=youngs_modulus,
        density=density,
        nominal=nominal,
    )
    return AffineModes(
        nodal,
        parameter=parameters,
        stiffness=basis.stiffness,
        mass=basis.mass,
        powers=whole,
        residual=_residual(matrices, interpolation.used_rows(), stiff, basis),
        report=str(basis.report),
        frequency_error=basis.report.measured.error,
    )


class Handed(NamedTuple):
    """A model as it was handed over: `finite_elements.modes(*handed, up_to=500.0)`."""

    matrices: Matrices
    interpolation: Interpolation


def from_scikit_fem(
    basis: Any,
    stiffness: Sparse,
    mass: Sparse,
    *,
    axes: tuple[int, ...],
    fixed: ArrayLike | None = None,
    regions: Mapping[str, Sparse] | None = None,
    origin: Float[np.ndarray, "3"] | None = None,
    directions: Float[np.ndarray, "3 local"] | None = None,
) -> Handed:
    """Take a scikit-fem model as it stands: a basis, and the matrices assembled on it.

    Parameters
    ----------
    basis
        A `skfem.CellBasis`, of any element that `interpolation.scikit_fem` reads.
    stiffness, mass
        Matrices on all its degrees of freedom [N/m, kg and so on].
    axes
        Axes of the components of the field: (3,) for the deflection of a plate, (1, 2, 3) for
        the displacement of a solid.
    fixed
        Degrees of freedom that are held: `basis.get_dofs("left")`, or their numbers.
    regions
        Stiffness of parts of the structure, by name; assembled on
        `skfem.Basis(mesh, element, elements=...)`.
    origin, directions
        Where and along what the mesh lies in space; see `interpolation.scikit_fem`.

    Raises
    ------
    TypeError
        If something else than a `skfem.CellBasis` was given.
    ValueError
        If the basis cannot be read between nodes, or the matrices do not fit it.
    MissingExtraError
        If scikit-fem is not installed.
    """
    reading = interpolation.scikit_fem(basis, axes=axes, origin=origin, directions=directions)
    rows = _scikit_fem_rows.table(basis, axes, origin, directions)
    held = None if fixed is None else np.asarray(fixed)
    whole = Matrices(stiffness, mass, rows.position, rows.dof, fixed=held, regions=regions)
    return Handed(whole, reading)


def _nodal(
    matrices: Matrices,
    interpolation: Interpolation,
    model: ModalModel,
    *,
    members: Mapping[str, Any],
    soft: Mapping[str, SupportMotion] | None = None,
    **more: Any,
) -> NodalModes:
    """Nodal modes with all that the matrices tell beside them."""
    rows = interpolation.used_rows()
    statics = None
    if soft is not None:
        statics = _openings.static_shapes(matrices, model, soft, members, rows)
    return nodal_modes.modes(
        model,
        interpolation,
        flexibility=matrices.static_flexibility(rows),
        regions=_over(model, matrices.regions),
        members=_over(model, members),
        centres=_middles(matrices, {**matrices.regions, **members}, soft or {}),
        statics=statics,
        mass=_mass(matrices),
        **more,
    )


def _over(model: ModalModel, parts: Mapping[str, Any]) -> dict[str, Float[np.ndarray, "mode mode"]]:
    """Matrices over the modes.

    Nothing within a free structure holds it: neither a region, nor a tension with its reaction.
    """
    free = np.arange(model.shape.shape[1]) < model.rigid_body_modes
    whole = {name: model.shape.T @ (one @ model.shape) for name, one in parts.items()}
    return {name: np.where(free | free[:, None], 0.0, one) for name, one in whole.items()}


def _residual(
    matrices: Matrices, rows: Rows, parts: Mapping[str, Sparse], basis: ReducedBasis
) -> Float[np.ndarray, "part row row"]:
    """F K_i F of each part [m/N] between rows, F the static flexibility outside of the basis."""
    elastic = slice(basis.rigid_body_modes, None)
    spanned = basis.basis[rows][:, elastic] / basis.squares[elastic]
    sparse = {name: csc_array(one) for name, one in parts.items()}
    touched = np.unique(np.concatenate([rows[:0], *(one.indices for one in sparse.values())]))
    under_load = matrices.static_flexibility(touched, rows)
    found = np.empty((len(parts), rows.size, rows.size))
    for number, (name, one) in enumerate(sparse.items()):
        inside = basis.stiffness[name][elastic, elastic]
        energy = under_load.T @ (one[touched][:, touched] @ under_load)
        found[number] = energy - spanned @ inside @ spanned.T
    return found


def _as_model(
    matrices: Matrices,
    shape: Float[np.ndarray, "dof vector"],
    squares: Float[np.ndarray, "vector"],
) -> ModalModel:
    """Vectors of a basis as if they were modes."""
    return ModalModel(
        node=matrices.node,
        position=matrices.position,
        dof=matrices.dof,
        shape=shape,
        natural_frequency=np.sqrt(squares) / (2 * np.pi),
    )


def _check_rows(interpolation: Interpolation) -> None:
    count = len(interpolation.used_rows())
    if count > MOST_ROWS:
        raise InputError(
            f"The interpolation reads {count} degrees of freedom; at most {MOST_ROWS} can have "
            "a static flexibility between all of them. Read only where transducers may sit: "
            "interpolation.near(position, radius)."
        )


def _middles(
    matrices: Matrices, parts: Mapping[str, Any], soft: Mapping[str, SupportMotion]
) -> dict[str, Coordinates]:
    """Mean of the nodes [m] that each part of the stiffness holds together, or a support holds."""
    rows = {name: part.nonzero()[0] for name, part in parts.items()}
    rows |= {name: one.rows for name, one in soft.items()}
    nodes = {name: np.isin(matrices.node, matrices.dof[one, 0]) for name, one in rows.items()}
    places = {name: matrices.position[chosen] for name, chosen in nodes.items() if chosen.any()}
    return {name: triple(place.mean(axis=0)) for name, place in places.items()}


def _mass(matrices: Matrices) -> float:
    """Mass that a rigid translation moves [kg]."""
    direction = int(np.min(matrices.dof[:, 1]))
    field = (matrices.dof[:, 1] == direction).astype(float)
    return float(field @ (matrices.mass @ field))
