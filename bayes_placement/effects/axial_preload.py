"""axial_preload: in, a tension; out, the modes of the beam under it.

Not known here: damping, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax
import numpy as np
from numpyro.distributions import Uniform

from .._sites import unit
from .._types import Parameter
from ..modes._lines import uniform_beam
from ..modes.beams.beams import UniformBeam
from ..modes.changed import ChangedModes, changed, mixed
from ..modes.finite_elements.nodal_modes import nodal_of
from ..modes.modes import Modes
from ._effect import GlobalChange, StructureEffect
from .member_preload import members


class AxialPreload(GlobalChange):
    """A tension along a beam, felt as the geometric stiffness T int w'^2 dx.

    Shaker, NASA TN D-8109 (1975). A compression is negative and must stay below buckling.

    Parameters
    ----------
    tension
        Tension [N].
    """

    absent: ClassVar[tuple[str, float]] = ("tension", 0.0)
    tension: Parameter = eqx.field(metadata=unit("N"))
    name: str = eqx.field(static=True, default="axial_preload", kw_only=True)

    def on(self, modes: Modes) -> "AxialPreload":
        """Refuse a structure that is no uniform beam.

        Raises
        ------
        ValueError
            If it is none.
        """
        _beam(modes)
        return self

    def changed(self, modes: Modes) -> ChangedModes:
        """Modes of the beam under tension."""
        return changed(modes, self.tension * mixed(modes, _beam(modes).slope_matrix()), None)

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence[StructureEffect]:
        """80 % of buckling to ten times as much in tension, of a beam or each member of a frame."""
        modes = experiment.structure.modes
        nodal = nodal_of(modes)
        if nodal is not None:
            return members(nodal)
        if not isinstance(modes, UniformBeam):
            return []
        critical = buckling_load(experiment.nominal().structure.modes)
        return [cls(Uniform(-0.8 * critical, 10 * critical))]


def buckling_load(beam: UniformBeam) -> float:
    """Least compression at which a beam loses its stiffness [N]."""
    rigid = beam.rigid_body_modes
    root = np.asarray(jax.jit(lambda: 1 / beam.angular_frequency()[rigid:])())
    slopes = np.asarray(jax.jit(lambda: beam.slope_matrix()[rigid:, rigid:])())
    return float(1 / np.linalg.eigvalsh(root[:, None] * slopes * root).max())


def _beam(modes: Modes) -> UniformBeam:
    return uniform_beam(
        modes,
        "axial_preload",
        "whose axial motion a preload does not change",
        "Name a member of the model: effects.member_preload(member, tension).",
    )


axial_preload = AxialPreload
