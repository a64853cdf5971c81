"""axial_preload: in, a tension; out, the modes of the beam under it.

Not known here: damping, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax
import numpy as np
from numpyro.distributions import Uniform

from .._changed_modes import ChangedModes, changed, line_of, mixed
from .._sites import unit
from .._types import Parameter
from ..beams import UniformBeam
from ..modes import Modes
from ..nodal_modes import NodalModes
from ._effect import GlobalChange
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

    def changed(self, modes: Modes) -> ChangedModes:
        """Modes of the beam under tension."""
        return changed(modes, self.tension * mixed(modes, _beam(modes).slope_matrix()), None)

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence[GlobalChange]:
        """80 % of buckling to ten times as much in tension, of a beam or each member of a frame."""
        modes = experiment.structure.modes
        if isinstance(modes, NodalModes):
            return members(modes)
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
    line = line_of(modes)
    if not isinstance(line, UniformBeam):
        raise ValueError(
            "axial_preload was added to a bar, whose axial motion a preload does not change. Use "
            "it on beams.beam."
        )
    return line


axial_preload = AxialPreload
