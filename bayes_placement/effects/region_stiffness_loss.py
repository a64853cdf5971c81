"""region_stiffness_loss: in, a region and a share; out, the modes of the structure without it.

Not known here: damping, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int

from .._changed_modes import ChangedModes, changed, mixed, nodal_below
from .._sites import unit
from .._types import Parameter
from ..modes import Modes
from ._effect import GlobalChange


class RegionStiffnessLoss(GlobalChange):
    """A share of the stiffness lost in one region of a finite element model: damage, a bad bond.

    The modes are those of K - loss K_region in the span of the kept modes (Friswell and
    Mottershead, Finite Element Model Updating in Structural Dynamics, ch. 7).

    Parameters
    ----------
    region
        Name of the region, or its number from 0.
    loss
        Share of its stiffness that is lost [1].
    """

    absent: ClassVar[tuple[str, float]] = ("loss", 0.0)
    region: str | int | Int[Array | np.ndarray, ""]
    loss: Parameter = eqx.field(metadata=unit("1"))
    name: str = eqx.field(static=True, default="local_stiffness_loss", kw_only=True)

    def on(self, modes: Modes) -> "RegionStiffnessLoss":
        """Return it with the number of its region.

        Raises
        ------
        ValueError
            If the structure has no such region.
        """
        if not isinstance(self.region, str):
            return self
        number = nodal_below(modes).regions.number(self.region, "The region")
        return type(self)(np.asarray(number), self.loss, name=self.name)

    def changed(self, modes: Modes) -> ChangedModes:
        """Modes of the structure with the weakened region."""
        nodal = nodal_below(modes)
        stiffness = (
            jnp.asarray(nodal.regions.matrices)[self.region]
            * nodal.stiffening()
            / nodal.heaviness()
        )
        return changed(modes, -self.loss * mixed(modes, stiffness))

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["RegionStiffnessLoss"]:
        """None: they are variants of `local_stiffness_loss`."""
        return []


region_stiffness_loss = RegionStiffnessLoss
