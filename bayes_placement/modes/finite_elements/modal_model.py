"""Modal model: nodes with mass-normalised mode shapes, from a finite element code."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from ..._shared.arguments import arguments_checked
from ..._shared.errors import InputError
from ..._shared.reprs import noun_html
from . import _modal_model_checks as checks

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz", "w_xy")
"""What the directions 1 to 7 of a degree of freedom mean; w_xy is the twist of a BFS plate."""


@dataclass(frozen=True, eq=False, repr=False)
class ModalModel:
    """Nodes, natural frequencies and mass-normalised mode shapes of an undamped structure.

    Build one with `from_arrays`, which checks and normalises, or read it with `bayes_placement.io`.

    Parameters
    ----------
    node
        Number of each node.
    position
        Its coordinates [m] in the global Cartesian system.
    dof
        Each degree of freedom: the number of its node and its direction, 1 to 7 for x, y, z, the
        rotations about them and the twist w_xy of a BFS plate.
    shape
        Mass-normalised mode shapes [kg^-1/2], of rotations [rad m^-1 kg^-1/2]; single precision
        stays single.
    natural_frequency
        Natural frequencies [Hz] in ascending order, rigid-body modes first with exactly 0.
    damping_ratio
        Modal damping ratios, where known.

    Examples
    --------
    >>> plane.natural_frequency, plane.shape.shape
    (array([120., 300.]), (27, 2))
    """

    node: Int[np.ndarray, "node"]
    position: Float[np.ndarray, "node 3"]
    dof: Int[np.ndarray, "dof 2"]
    shape: Float[np.ndarray, "dof mode"]
    natural_frequency: Float[np.ndarray, "mode"]
    damping_ratio: Float[np.ndarray, "mode"] | None = None

    @classmethod
    @arguments_checked
    def from_arrays(
        cls,
        *,
        position: ArrayLike,
        shape: ArrayLike,
        natural_frequency: ArrayLike,
        modal_mass: ArrayLike | float | int | None = None,
        node: ArrayLike | None = None,
        dof: ArrayLike | None = None,
        damping_ratio: ArrayLike | None = None,
        length_unit: float = 1.0,
        mass_unit: float = 1.0,
    ) -> "ModalModel":
        """Check the arrays of a finite element code, and normalise shapes by the modal masses.

        A mode counts as rigid, and its natural frequency is set to exactly 0, where it lies below
        1e-3 of the first elastic one; at most six modes do, and those that are given as 0. At
        most one array of the size of `shape` is made, none where all modal masses are 1; then the
        model holds `shape` itself.

        Parameters
        ----------
        position
            Coordinates [m] of each node in the global Cartesian system, `[node, 3]`.
        shape
            Mode shapes `[node, axis, mode]` with three axes (x, y, z) or six (rotations too), or
            `[dof, mode]` with `dof` naming each row.
        natural_frequency
            Natural frequencies [Hz] in ascending order, `[mode]`.
        modal_mass
            Modal mass [kg] of each mode for the shapes as given, `[mode]`; 1 where they are
            mass-normalised.
        node
            Number of each node, `[node]`; 1, 2, 3 and so on if left out.
        dof
            Node number and direction (1 to 7) of each row, `[dof, 2]`.
        damping_ratio
            Modal damping ratios, `[mode]`.
        length_unit, mass_unit
            One unit of the arrays in metres and in kilograms (time is in seconds): 1e-3 and 1e3
            for a model in mm, t and N.

        Returns
        -------
        ModalModel
            Nodes and modes in SI, in ascending order of the natural frequencies.

        Raises
        ------
        InputError
            If sizes disagree, numbers are missing, or nodes, rows and frequencies are
            inconsistent.
        """
        length_unit = checks.checked_unit(length_unit, "length_unit")
        mass_unit = checks.checked_unit(mass_unit, "mass_unit")
        position = checks.checked_position(position) * length_unit
        node = checks.checked_node(node, len(position))
        shape, dof = checks.by_row(shape, dof, node)
        frequency = checks.checked_frequency(natural_frequency, shape.shape[1])
        checks.check_shape(shape)
        dof = checks.checked_dof(dof, node, len(shape))
        mass = checks.checked_mass(modal_mass, frequency.size) * mass_unit
        return cls(
            node=node,
            position=position,
            dof=dof,
            shape=checks.normalised(shape, dof[:, 1], mass, length_unit),
            natural_frequency=checks.without_rigid_residue(frequency),
            damping_ratio=checks.checked_damping(damping_ratio, frequency.size),
        )

    @property
    def rigid_body_modes(self) -> int:
        """Number of modes with a natural frequency of 0."""
        return int(np.count_nonzero(self.natural_frequency == 0))

    def restricted(self, nodes: Iterable[int]) -> "ModalModel":
        """Keep these nodes only, in the order of the model.

        Raises
        ------
        InputError
            If the model has no node of such a number.
        """
        wanted = np.unique(np.fromiter(nodes, dtype=np.int64))
        checks.check_known(wanted, self.node)
        selected = np.isin(self.node, wanted)
        rows = np.flatnonzero(np.isin(self.dof[:, 0], wanted))
        return replace(
            self,
            node=self.node[selected],
            position=self.position[selected],
            dof=self.dof[rows],
            shape=self.shape[rows],
        )

    def without_unused_directions(self) -> "ModalModel":
        """Leave out the directions in which no node moves in any mode.

        Files have three or six values of every node, also where a plate moves only across its
        plane, and where a solid has no rotations.
        """
        direction = self.dof[:, 1]
        used = [kind for kind in np.unique(direction) if self.shape[direction == kind].any()]
        rows = np.flatnonzero(np.isin(direction, used))
        if rows.size == len(self.dof):
            return self
        return replace(self, dof=self.dof[rows], shape=self.shape[rows])

    def count(self, modes: int) -> "ModalModel":
        """Keep the lowest modes, rigid-body modes included.

        Raises
        ------
        InputError
            If the model has fewer, or none is asked for.
        """
        known = self.natural_frequency.size
        if not 1 <= modes <= known:
            raise InputError(
                f"count({modes}) was asked of a model of {known} modes; 1 to {known} are needed, "
                "since other modes are unknown. Ask for fewer, or let the finite element code "
                "compute more."
            )
        damping = self.damping_ratio
        return replace(
            self,
            shape=self.shape[:, :modes],
            natural_frequency=self.natural_frequency[:modes],
            damping_ratio=None if damping is None else damping[:modes],
        )

    def below(self, frequency: float) -> "ModalModel":
        """Keep the modes below a frequency [Hz].

        Raises
        ------
        InputError
            If there is none.
        """
        modes = int(np.count_nonzero(self.natural_frequency < frequency))
        if not modes:
            raise InputError(
                f"below({frequency:g}) keeps no mode: the lowest natural frequency is "
                f"{self.natural_frequency[0]:g} Hz. At least one is needed, since a structure "
                "without modes does not move. Give a higher frequency, in Hz and not in rad/s."
            )
        return self.count(modes)

    def __repr__(self) -> str:
        directions = (DIRECTIONS[number - 1] for number in np.unique(self.dof[:, 1]))
        damping = "not known" if self.damping_ratio is None else "known"
        return (
            f"ModalModel: {self.node.size} nodes, {len(self.dof)} degrees of freedom "
            f"({', '.join(directions)}), {self.natural_frequency.size} modes up to "
            f"{self.natural_frequency[-1]:g} Hz, {self.rigid_body_modes} of them rigid-body modes; "
            f"damping {damping}"
        )

    _repr_html_ = noun_html
