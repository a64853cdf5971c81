"""A region of a finite element model that has lost stiffness."""

import numpy as np
from jaxtyping import Array, Int

from .._shared.ranges import SHARE_LOST
from ..modes.finite_elements.nodal_modes import NodalModes, nodal_of
from ..modes.flexible_parts import WeakenedRegion
from .on_part import OnPart
from .prelude import LogUniform, Modes, Parameter, Scales, field, negative_log_uniform, unit


class RegionStiffnessLoss(OnPart):
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
    part = "region"
    region: str | int | Int[Array | np.ndarray, ""]
    loss: Parameter = field(metadata=unit("1", within=SHARE_LOST))
    name: str = field(static=True, default="local_stiffness_loss", kw_only=True)

    @staticmethod
    def names(nodal: NodalModes) -> tuple[str, ...]:
        """Names of all regions."""
        return nodal.regions.names

    def hinges(self, modes: Modes) -> list[WeakenedRegion]:
        """The region, as a part of the model that becomes softer."""
        return [WeakenedRegion(self.region, self.loss)]  # type: ignore[arg-type]

    @classmethod
    def suggest(cls, scales: Scales) -> list["RegionStiffnessLoss"]:
        """0.3 % to 95 % lost, or 0.3 % to 200 % added, in each region of a finite element model."""
        nodal = nodal_of(scales.modes)
        count = 0 if nodal is None else len(nodal.regions.names)
        losses = LogUniform(0.003, 0.95), negative_log_uniform(0.003, 2.0)
        return [cls(np.asarray(number), loss) for loss in losses for number in range(count)]
