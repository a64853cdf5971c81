"""A joint of a frame that turns where it was modelled as rigid."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int

from ..modes.changed import original_nodal_modes
from ..modes.finite_elements.nodal_modes import NodalModes
from ..modes.flexible_parts import CompliantPart
from .prelude import Instruments, Modes, Parameter, Scales, field, unit
from .region_stiffness_loss import OnPart
from .soft_support import compliances


class LooseJoint(OnPart):
    """A joint of a frame with a rotational compliance: a bolted corner, a cracked weld.

    The end of one element is joined to its node by a rotational spring; a compliance of zero is
    the joint as it was modelled, an infinite one a hinge (McGuire, Gallagher and Ziemian, Matrix
    Structural Analysis, ch. 13). The attachment mode of its moment and the modes of the model
    together span the motion.

    Parameters
    ----------
    joint
        Name of the joint in `finite_elements.joints(matrices)`, or its number from 0.
    compliance
        Rotation per moment [rad/(N m)].

    Examples
    --------
    >>> root = bp.finite_elements.joints(matrices)
    >>> modes = bp.finite_elements.modes(matrices, reading, up_to=500.0, joints=root)
    >>> beam = bp.Structure(modes, damping=bp.damping.Modal(0.02))
    >>> beam + bp.effects.loose_joint("node 1 about z", dist.LogUniform(1e-5, 1e-2))
    Structure: NodalModes, Modal damping, with loose_joint
    """

    absent = ("compliance", 0.0)
    part = "joint"
    source = "finite_elements.modes(..., joints=finite_elements.joints(matrices))"
    joint: str | int | Int[Array | np.ndarray, ""]
    compliance: Parameter = field(metadata=unit("rad/(N m)"))
    name: str = field(static=True, default="loose_joint", kw_only=True)

    @staticmethod
    def names(nodal: NodalModes) -> tuple[str, ...]:
        """Names of all joints that may be loose."""
        return nodal.static_shapes.joints

    def hinges(self, modes: Modes) -> list[CompliantPart]:
        """The joint, which is a part of the model that becomes softer, after all supports."""
        supports = original_nodal_modes(modes).static_shapes.supports
        number = len(supports) + jnp.asarray(self.joint)  # an array, once it was found by name
        return [CompliantPart(number, self.compliance)]

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Node and axis of the joint."""
        return f"joint at {self._name(modes)}"

    def remark(self, estimates: Mapping[str, tuple[float, float]]) -> str:
        """Say how stiff its spring is, where that is known."""
        mean, deviation = estimates.get("compliance", (0.0, 0.0))
        if mean <= 2 * deviation:
            return ""
        stiffness = np.format_float_positional(
            1 / mean, precision=4, unique=False, fractional=False, trim="-"
        )
        return f"a spring of {stiffness} N m/rad"

    @classmethod
    def suggest(cls, scales: Scales) -> list["LooseJoint"]:
        """Each joint, from a millionth of the compliance of the structure to ten times as much."""
        _, priors = compliances(scales.modes)
        return [cls(np.asarray(number), prior) for number, prior in enumerate(priors)]
