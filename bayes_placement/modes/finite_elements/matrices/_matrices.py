"""Sparse stiffness and mass of a finite element model: its modes and static shapes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import ArrayLike
from scipy.sparse import csc_array

from ...._shared.arguments import arguments_checked
from ...._shared.reprs import noun_html
from ..modal_model import ModalModel
from . import _eigenmodes as eigenmodes
from . import _matrix_checks as checks
from . import _static_flexibility as direct
from ._matrix_checks import Sparse
from ._reduced_basis import Affine, ReducedBasis, reduced_basis


class Release(NamedTuple):
    """Constraint modes of held rows that become soft, with their stiffness and mass."""

    rows: Int[np.ndarray, "released"]
    shape: Float[np.ndarray, "dof released"]
    """Displacement under a unit displacement of each row, the others held [m/m]."""
    stiffness: Float[np.ndarray, "released released"]
    """Reactions [N/m] in the rows."""
    mass: Float[np.ndarray, "released released"]
    """Modal masses of the shapes [kg]."""
    mass_with_modes: Float[np.ndarray, "mode released"]
    """Mass products of the shapes with mass-normalised modes [kg^1/2]."""


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Matrices:
    """Stiffness and mass of an undamped structure, on all its degrees of freedom.

    The stiffness is factorised once, at first use.

    Parameters
    ----------
    stiffness, mass
        Symmetric matrices [N/m, kg and so on], any SciPy sparse format, held rows included.
    position
        Coordinates [m] of each node, `[node, 3]`.
    dof
        Node number and direction (1 to 7 for x, y, z, rx, ry, rz, w_xy) of each row.
    node
        Number of each node; 1, 2, 3 and so on if left out.
    fixed
        Rows that are held; none for a free structure.
    regions
        Stiffness of parts of the structure, by name.

    Raises
    ------
    InputError
        If sizes disagree, numbers are missing, a matrix is not symmetric, mass is negative, or
        regions exceed the stiffness.

    Examples
    --------
    >>> matrices.modes(count=2).natural_frequency.round(3)
    array([ 9.011, 56.532])
    >>> matrices.static_flexibility([8])  # (1 m)^3 / (3 * 70 N m2)
    array([[0.0047619]])
    """

    stiffness: csc_array
    mass: csc_array
    position: Float[np.ndarray, "node 3"]
    dof: Int[np.ndarray, "dof 2"]
    node: Int[np.ndarray, "node"]
    fixed: Int[np.ndarray, "fixed"]
    regions: dict[str, csc_array]

    @arguments_checked
    def __init__(
        self,
        stiffness: Sparse,
        mass: Sparse,
        position: ArrayLike,
        dof: ArrayLike,
        node: ArrayLike | None = None,
        fixed: ArrayLike | None = None,
        regions: Mapping[str, Sparse] | None = None,
    ) -> None:
        position, node, dof = checks.nodes(position, node, dof)
        stiffness, mass = (
            checks.symmetric(name, checks.sparse(name, matrix, len(dof)), dof)
            for name, matrix in (("stiffness", stiffness), ("mass", mass))
        )
        fixed = checks.fixed_rows(fixed, len(dof))
        free = np.setdiff1d(np.arange(len(dof)), fixed)
        checks.mass(mass, stiffness, dof, free)
        checks.kinetic_energy(mass, free)
        regions = checks.regions(regions or {}, stiffness, dof)
        fields = dict(stiffness=stiffness, mass=mass, position=position, dof=dof, node=node)
        for name, value in (fields | dict(fixed=fixed, regions=regions)).items():
            object.__setattr__(self, name, value)

    @property
    def rigid_body_modes(self) -> int:
        """Number of motions without strain energy that the supports leave."""
        return self.flexibility.fields.shape[1]

    def modes(self, *, count: int | None = None, up_to: float | None = None) -> ModalModel:
        """Solve the eigenproblem for the lowest modes; inertia counts show that none is missed.

        A rigid-body mode is a motion that needs no force: a combination of the six motions of a
        rigid body that vanishes at held rows and whose force is below 1e-11 of the stiffness met
        in every row, or (hinges, loose parts) any other whose strain energy is below 1e-14 of the
        energies met. Its natural frequency is exactly 0. A soft suspension is thus elastic.

        Parameters
        ----------
        count
            Number of modes, rigid-body modes included.
        up_to
            All modes up to this frequency [Hz], in place of `count`.

        Returns
        -------
        ModalModel
            Mass-normalised shapes on all rows, 0 where held, the largest entry positive.

        Raises
        ------
        InputError
            If there are fewer modes, or none that low, or the stiffness is not positive.
        """
        flexibility, rigid = self.flexibility, self.rigid_body_modes
        checks.asked(count, up_to)
        if up_to is not None:
            elastic = eigenmodes.below(flexibility, (2 * np.pi * up_to) ** 2)
            checks.any_below(rigid + elastic.eigenvalues.size, up_to)
        else:
            elastic = eigenmodes.lowest(flexibility, (count or 0) - rigid)
        natural = np.sqrt(elastic.eigenvalues) / (2 * np.pi)
        frequency = np.concatenate([np.zeros(rigid), natural])
        shape = np.hstack([flexibility.fields, elastic.shape])
        return ModalModel(
            node=self.node,
            position=self.position,
            dof=self.dof,
            shape=self._on_all_rows(shape)[:, :count],
            natural_frequency=frequency[:count],
        )

    def static_flexibility(
        self, rows: ArrayLike, columns: ArrayLike | None = None, *, power: Literal[1, 2] = 1
    ) -> Float[np.ndarray, "response reference"]:
        """Static flexibility of all elastic modes between rows, 0 where held.

        The receptance of the modes left out is that flexibility less the part of the modes kept,
        plus, to second order, omega^2 times the sum of power 2 less their part.

        Parameters
        ----------
        rows
            Where displacement is read.
        columns
            Where forces act; `rows` if left out.
        power
            1 for the static flexibility, 2 for its change with the square of the frequency.

        Returns
        -------
        Float[np.ndarray, "response reference"]
            The sum over all elastic modes of phi phi / omega_n^(2 power) [m s^(2 power - 2) / N].
        """
        response = checks.known_rows("rows", rows, len(self.dof))
        reference = response
        if columns is not None:
            reference = checks.known_rows("columns", columns, len(self.dof))
        number = np.full(len(self.dof), -1)
        number[self._order] = np.arange(self._order.size)
        moving, driven = number[response] >= 0, number[reference] >= 0
        flexibility = np.zeros((response.size, reference.size))
        flexibility[np.ix_(moving, driven)] = self.flexibility.between(
            number[response[moving]], number[reference[driven]], power
        )
        return _symmetric(flexibility) if columns is None else flexibility

    def displacement(self, force: Float[np.ndarray, "dof load"]) -> Float[np.ndarray, "dof load"]:
        """Static displacement [m] of all elastic modes under forces [N] on all rows, 0 where held.

        Parameters
        ----------
        force
            Forces, one column for each load.
        """
        return self._on_all_rows(self.flexibility(force[self._order]))

    def without(
        self, part: Sparse
    ) -> Callable[[Float[np.ndarray, "dof load"]], Float[np.ndarray, "dof load"]]:
        """Return `displacement` of the structure without a part of its stiffness.

        Parameters
        ----------
        part
            A part whose removal leaves the structure held, such as a share of a region.
        """
        order = self._order
        stiffness = csc_array(self.flexibility.stiffness - csc_array(part)[order][:, order])
        weakened = self.flexibility.changed(stiffness, self.flexibility.mass)
        return lambda force: self._on_all_rows(weakened(force[order]))

    def receptance(
        self,
        rows: ArrayLike,
        columns: ArrayLike,
        frequency: Float[np.ndarray, "frequency"],
        *,
        modes: ModalModel | None = None,
        damping_ratio: float | Float[np.ndarray, "mode"] = 0.0,
        loss_factor: float = 0.0,
    ) -> Complex[np.ndarray, "response reference frequency"]:
        """Receptance by a direct solution at each frequency: the reference for modal sums.

        Parameters
        ----------
        rows, columns
            Where displacement is read and where forces act.
        frequency
            Lines [Hz].
        modes, damping_ratio
            Viscous damping D = M Phi diag(2 zeta omega_n) Phi^T M of these modes.
        loss_factor
            Structural damping, K (1 + i eta).

        Returns
        -------
        Complex[np.ndarray, "response reference frequency"]
            Receptance [m/N], time convention exp(+i omega t).
        """
        size = len(self.dof)
        shape = np.zeros((size, 0)) if modes is None else modes.shape
        natural = np.zeros(0) if modes is None else 2 * np.pi * modes.natural_frequency
        damping = direct.ModalDamping((self.mass @ shape)[self._order], 2 * natural * damping_ratio)
        return direct.receptance(
            self.flexibility.stiffness * (1 + 1j * loss_factor),
            self.flexibility.mass,
            damping,
            self._unit(checks.known_rows("rows", rows, size)),
            self._unit(checks.known_rows("columns", columns, size)),
            2 * np.pi * np.asarray(frequency, dtype=float),
        )

    def release(self, rows: ArrayLike, modes: ModalModel) -> Release:
        """Constraint modes of held rows that become soft.

        Craig & Bampton, Coupling of substructures for dynamic analyses, 1968,
        DOI 10.2514/3.4741: one row at a time is displaced by one, the others held.

        Parameters
        ----------
        rows
            Some of `fixed`.
        modes
            Modes of this structure, whose mass products with the shapes are computed.

        Raises
        ------
        InputError
            If a row is not held, or the structure can move as a rigid body.
        """
        released = checks.known_rows("rows", rows, len(self.dof))
        checks.releasable(released, self.fixed, self.rigid_body_modes, self.dof)
        shape = np.zeros((len(self.dof), released.size))
        shape[released, np.arange(released.size)] = 1.0
        force = (self.stiffness @ shape)[self._order]
        shape[self._order] = -self.flexibility(force)
        inertia = self.mass @ shape
        return Release(
            rows=released,
            shape=shape,
            stiffness=_symmetric(shape.T @ (self.stiffness @ shape)),
            mass=_symmetric(shape.T @ inertia),
            mass_with_modes=modes.shape.T @ inertia,
        )

    def reduced_basis(
        self, affine: Affine, *, up_to: float, tolerance: float = 1e-3, margin: float = 1.5
    ) -> ReducedBasis:
        """Fixed basis for factors of parts of the stiffness and mass.

        Parameters
        ----------
        affine
            The parts and the box of their factors.
        up_to
            Natural frequencies up to this one [Hz] are to be accurate.
        tolerance
            Largest relative error of a natural frequency within the box.
        margin
            The basis begins with the nominal modes up to `margin` times `up_to`.

        Returns
        -------
        ReducedBasis
            The basis, and how accurate it is.

        Raises
        ------
        InputError
            If parts do not fit the matrices, or the tolerance is not reached.
        """
        parts = checks.affine(affine, self.dof).among(self._order)
        reduced = reduced_basis(self.flexibility, parts, up_to, tolerance=tolerance, margin=margin)
        return reduced._replace(basis=self._on_all_rows(reduced.basis))

    @cached_property
    def flexibility(self) -> direct.StaticFlexibility:
        """Factorised stiffness on the rows that may move, in the order of elimination."""
        order = self._order
        fields = direct.geometric_fields(self.position[self.node_index], self.dof[:, 1])
        stiffness, mass = (
            csc_array(matrix[order][:, order]) for matrix in (self.stiffness, self.mass)
        )
        unforced = direct.free_fields(stiffness, fields[order], fields[self.fixed])
        return direct.static_flexibility(stiffness, mass, unforced, self.dof[order, 1])

    @cached_property
    def _order(self) -> Int[np.ndarray, "row"]:
        """Rows that may move, in the order of elimination."""
        free = np.setdiff1d(np.arange(len(self.dof)), self.fixed)
        couplings = csc_array(abs(self.stiffness[free][:, free]) + abs(self.mass[free][:, free]))
        return free[direct.nested_dissection(couplings, self.node_index[free], self.position)]

    @cached_property
    def node_index(self) -> Int[np.ndarray, "dof"]:
        """Index of the node of each row."""
        by_number = np.argsort(self.node)
        return by_number[np.searchsorted(self.node[by_number], self.dof[:, 0])]

    def _on_all_rows(self, shape: Float[np.ndarray, "row mode"]) -> Float[np.ndarray, "dof mode"]:
        full = np.zeros((len(self.dof), shape.shape[1]))
        full[self._order] = shape
        return full

    def _unit(self, rows: Int[np.ndarray, "chosen"]) -> Float[np.ndarray, "row chosen"]:
        return (self._order[:, None] == rows).astype(float)

    def __repr__(self) -> str:
        return (
            f"Matrices: {self.node.size} nodes, {len(self.dof)} degrees of freedom, "
            f"{self.fixed.size} of them held, {len(self.regions)} regions"
        )

    _repr_html_ = noun_html


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return (matrix + matrix.T) / 2
