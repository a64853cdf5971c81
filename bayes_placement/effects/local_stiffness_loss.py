"""local_stiffness_loss: in, a place, an extent and a share; out, the hinges that it opens.

Not known here: damping, data.
"""

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from numpyro.distributions import LogUniform

from .._sites import unit
from .._types import Parameter
from ..modes._lines import uniform_line
from ..modes.beams.uniform_line import UniformLine
from ..modes.changed import line_of
from ..modes.finite_elements.nodal_modes import nodal_of
from ..modes.hinged import Hinge
from ..modes.modes import Modes
from . import _scales, _words
from ._effect import Hinged, Place, StructureEffect, is_place, placed
from .region_stiffness_loss import RegionStiffnessLoss


class LocalStiffnessLoss(Hinged):
    """A share of the bending (axial) stiffness lost along a short stretch: a crack, a notch.

    The flexibility 1 / (E I) grows by loss / (1 - loss) / (E I) along the extent (Friswell and
    Penny, Structural Health Monitoring 1 (2002) 139); two hinges at the Gauss points of the
    stretch carry it.

    Parameters
    ----------
    at
        Middle of the stretch [m].
    extent
        Its length [m].
    loss
        Share of the stiffness that is lost [1].
    """

    absent: ClassVar[tuple[str, float]] = ("loss", 0.0)
    at: Place = eqx.field(metadata=unit("m"))
    extent: Parameter = eqx.field(metadata=unit("m"))
    loss: Parameter = eqx.field(metadata=unit("1"))
    name: str = eqx.field(static=True, default="local_stiffness_loss", kw_only=True)

    def on(self, modes: Modes) -> "LocalStiffnessLoss":
        """Return it placed on a structure, a segment as the uniform law over it.

        Raises
        ------
        ValueError
            If the structure is no uniform bar or beam, or the place lies outside.
        """
        instead = "Name a region of the model: effects.region_stiffness_loss(region, loss)."
        uniform_line(modes, "local_stiffness_loss", instead)
        law = placed(self.at, modes, self.name)
        return eqx.tree_at(lambda one: one.at, self, law, is_leaf=is_place)

    def hinges(self, modes: Modes) -> list[Hinge]:
        """Two hinges, each with half of the flexibility."""
        line = line_of(modes)
        compliance = self.extent * self.loss / (1 - self.loss) / line.stiffness / 2
        offset = self.extent / (2 * math.sqrt(3))
        places = [jnp.clip(self.at + side * offset, 0.0, line.length) for side in (-1, 1)]
        return [Hinge(place, line.half_order, compliance) for place in places]

    def setting(self, experiment: Any) -> str:
        """Where it is, if that is known."""
        return _words.place(self.at, experiment.structure.modes.bounds())

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence[StructureEffect]:
        """A loss of 0.3 % to 95 % along 1 % to 10 % of a line, or of each region of a model."""
        modes, loss = experiment.structure.modes, LogUniform(0.003, 0.95)
        nodal = nodal_of(modes)
        if nodal is not None:
            regions = range(len(nodal.regions.names))
            return [RegionStiffnessLoss(np.asarray(one), loss) for one in regions]
        if not isinstance(modes, UniformLine):
            return []
        length = float(np.max(modes.bounds()[1]))
        extent = LogUniform(0.01 * length, 0.1 * length)
        return [cls(place, extent, loss) for place in _scales.anywhere(experiment)]


local_stiffness_loss = LocalStiffnessLoss
