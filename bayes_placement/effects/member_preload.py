"""member_preload: in, a member and a tension; out, what its stiffness gains.

Not known here: damping, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Int
from numpyro.distributions import Uniform

from .._sites import unit
from .._types import Parameter
from ..modes.changed import nodal_below
from ..modes.finite_elements.nodal_modes import NodalModes
from ..modes.modes import Modes
from ..modes.yielding import StretchedMember
from . import _words
from ._effect import Hinged


class MemberPreload(Hinged):
    """A tension in one member of a frame, felt as its geometric stiffness.

    Przemieniecki, Theory of Matrix Structural Analysis, ch. 15. A compression is negative.

    Parameters
    ----------
    member
        Name of the member, or its number from 0.
    tension
        Tension [N].
    """

    absent: ClassVar[tuple[str, float]] = ("tension", 0.0)
    member: str | int | Int[Array | np.ndarray, ""]
    tension: Parameter = eqx.field(metadata=unit("N"))
    name: str = eqx.field(static=True, default="axial_preload", kw_only=True)

    def on(self, modes: Modes) -> "MemberPreload":
        """Return it with the number of its member.

        Raises
        ------
        ValueError
            If the structure has no such member.
        """
        if not isinstance(self.member, str):
            return self
        number = nodal_below(modes).members.number(self.member, "The member")
        return type(self)(np.asarray(number), self.tension, name=self.name)

    def hinges(self, modes: Modes) -> list[StretchedMember]:
        """One member that gains geometric stiffness."""
        return [StretchedMember(self.member, self.tension)]  # type: ignore[arg-type]

    def setting(self, experiment: Any) -> str:
        """Which member it is about."""
        names = nodal_below(experiment.structure.modes).members.names
        return f"tension in {_words.among(self.member, names)}"

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["MemberPreload"]:
        """None: they are variants of `axial_preload`."""
        return []


member_preload = MemberPreload


def members(modes: NodalModes) -> list[MemberPreload]:
    """From 80 % of the load at which a member alone makes the frame buckle to ten times as much."""
    count = len(modes.members.names)
    loads = [buckling_load(modes, number) for number in range(count)]
    return [
        MemberPreload(np.asarray(number), Uniform(-0.8 * load, 10 * load))
        for number, load in enumerate(loads)
    ]


def buckling_load(modes: NodalModes, member: int) -> float:
    """Least compression of one member at which the frame loses its stiffness [N]."""
    elastic = slice(modes.rigid_body_modes, None)
    root = 1 / np.sqrt(modes.squares[elastic])
    slopes = np.asarray(modes.members.matrices[member])[elastic, elastic]
    return float(1 / np.linalg.eigvalsh(root[:, None] * slopes * root).max())
