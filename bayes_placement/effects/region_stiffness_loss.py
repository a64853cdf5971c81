"""A region of a finite element model that has lost stiffness."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, Int
from numpyro.distributions import LogUniform

from ..modes.finite_elements.nodal_modes import nodal_of
from ..modes.flexible_parts import WeakenedRegion
from ..modes.underlying import underlying_nodal_modes
from ._parts import centre, check_number, name_of
from .prelude import SHARE_LOST, Hinged, Instruments, Location, Modes, Parameter, Scales, unit
from .signed import negative_log_uniform


class RegionStiffnessLoss(Hinged):
    """A share of the stiffness lost in one region of a finite element model: damage, a bad bond.

    The stiffness is K - loss K_region (Friswell and Mottershead, Finite Element Model Updating in
    Structural Dynamics, ch. 7). Where the matrices are known, it acts on attachment modes of the
    region, or on the modes where these are all that there are; else on the span of the kept modes,
    which describes a loss of a few percent only.

    Parameters
    ----------
    region
        Name of the region, or its number from 0.
    loss
        Share of its stiffness that is lost, less than 1 [1]; negative where it is stiffer.

    Examples
    --------
    >>> modes = bp.finite_elements.modes(matrices, reading, up_to=500.0)
    >>> beam = bp.Structure(modes, damping=bp.damping.Modal(0.02))
    >>> beam + bp.effects.region_stiffness_loss("root", loss=dist.Uniform(0.0, 0.5))
    Structure: NodalModes, Modal damping, with local_stiffness_loss
    """

    absent = ("loss", 0.0)
    if_negative = "stiffer, not softer"
    acts_on = "region"
    region: str | int | Int[Array | np.ndarray, ""]
    loss: Parameter = eqx.field(metadata=unit("1", within=SHARE_LOST))
    name: str = eqx.field(static=True, default="local_stiffness_loss", kw_only=True)

    def on(self, modes: Modes) -> "RegionStiffnessLoss":
        """Return the effect with its region by number."""
        if not isinstance(self.region, str):
            check_number(self.region, underlying_nodal_modes(modes).regions.names)
            return self
        number = underlying_nodal_modes(modes).regions.number(self.region, "The region")
        return type(self)(np.asarray(number), self.loss, name=self.name)

    def hinges(self, modes: Modes) -> list[WeakenedRegion]:
        """The region, as a part of the model that becomes softer."""
        return [WeakenedRegion(self.region, self.loss)]  # type: ignore[arg-type]

    def location(self, modes: Modes, instruments: Instruments) -> Location | None:
        """Centre of the region [m]."""
        return centre(modes, self._name(modes))

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Name of the region."""
        return f"region {self._name(modes)}"

    def _name(self, modes: Modes) -> str:
        return name_of(self.region, underlying_nodal_modes(modes).regions.names)

    @classmethod
    def suggest(cls, scales: Scales) -> list["RegionStiffnessLoss"]:
        """0.3 % to 95 % lost, or 0.3 % to 200 % added, in each region of a finite element model."""
        nodal = nodal_of(scales.modes)
        count = 0 if nodal is None else len(nodal.regions.names)
        losses = LogUniform(0.003, 0.95), negative_log_uniform(0.003, 2.0)
        return [cls(np.asarray(number), loss) for loss in losses for number in range(count)]
