"""region_stiffness_loss: in, a region and a share; out, how it yields.

Not known here: damping, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Int

from .._sites import unit
from .._types import Parameter
from ..modes.changed import nodal_below
from ..modes.modes import Modes
from ..modes.yielding import WeakenedRegion
from . import _words
from ._effect import Hinged


class RegionStiffnessLoss(Hinged):
    """A share of the stiffness lost in one region of a finite element model: damage, a bad bond.

    The stiffness is K - loss K_region (Friswell and Mottershead, Finite Element Model Updating in
    Structural Dynamics, ch. 7). Where the matrices are known, its flexibility is used, with
    static shapes in which the region yields; else the span of the kept modes, which follows a
    loss of a few percent only.

    Parameters
    ----------
    region
        Name of the region, or its number from 0.
    loss
        Share of its stiffness that is lost, less than 1 [1].
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

    def hinges(self, modes: Modes) -> list[WeakenedRegion]:
        """One region that yields."""
        return [WeakenedRegion(self.region, self.loss)]  # type: ignore[arg-type]

    def setting(self, experiment: Any) -> str:
        """Which region it is about."""
        names = nodal_below(experiment.structure.modes).regions.names
        return f"region {_words.among(self.region, names)}"

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["RegionStiffnessLoss"]:
        """None: they are variants of `local_stiffness_loss`."""
        return []


region_stiffness_loss = RegionStiffnessLoss
