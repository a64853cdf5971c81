"""A tension in one member of a finite element frame."""

import numpy as np
from jaxtyping import Array, Int

from ..modes.finite_elements.nodal_modes import NodalModes, nodal_of
from ..modes.flexible_parts import StretchedMember
from .axial_preload import critical, preload_prior
from .prelude import Instruments, Modes, Parameter, Scales, field, unit
from .region_stiffness_loss import OnPart


class MemberPreload(OnPart):
    """A tension in one member of a frame, which adds its geometric stiffness.

    Przemieniecki, Theory of Matrix Structural Analysis, ch. 15. A compression is negative.

    Parameters
    ----------
    member
        Name of the member, or its number from 0.
    tension
        Tension [N].

    Examples
    --------
    >>> geometric = np.diag(np.full(10, 2.0))  # `frame_geometric_stiffness` makes one of elements
    >>> members = {"brace": geometric}
    >>> modes = bp.finite_elements.modes(matrices, reading, up_to=500.0, members=members)
    >>> brace = bp.Structure(modes, damping=bp.damping.Modal(0.02))
    >>> brace + bp.effects.member_preload("brace", tension=dist.Uniform(0.0, 40.0))
    Structure: NodalModes, Modal damping, with axial_preload
    """

    absent = ("tension", 0.0)
    part = "member"
    source = 'finite_elements.modes(..., members={"brace": geometric})'
    member: str | int | Int[Array | np.ndarray, ""]
    tension: Parameter = field(metadata=unit("N"))
    name: str = field(static=True, default="axial_preload", kw_only=True)

    @staticmethod
    def names(nodal: NodalModes) -> tuple[str, ...]:
        """Names of all members."""
        return nodal.members.names

    def hinges(self, modes: Modes) -> list[StretchedMember]:
        """One member that gains geometric stiffness."""
        return [StretchedMember(self.member, self.tension)]  # type: ignore[arg-type]

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Name of the member."""
        return f"tension in {self._name(modes)}"

    @classmethod
    def suggest(cls, scales: Scales) -> list["MemberPreload"]:
        """80 % of the compression at which the frame buckles to ten times as much in tension.

        Log-uniform from 0.01 % on, for each member of a finite element model, whose buckling load
        is that of the frame with this member alone under compression.
        """
        nodal = nodal_of(scales.modes)
        if nodal is None:
            return []
        loads = [buckling_load(nodal, number) for number in range(len(nodal.members.names))]
        return [cls(np.asarray(number), preload_prior(load)) for number, load in enumerate(loads)]


def buckling_load(modes: NodalModes, member: int) -> float:
    """Least compression of one member at which the frame loses its stiffness [N]."""
    slopes = modes.members.matrices[member]
    return critical(np.sqrt(modes.eigenvalues), slopes, modes.rigid_body_modes)
