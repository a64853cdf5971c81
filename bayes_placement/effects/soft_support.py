"""A support of a finite element model that is softer than assumed."""

import dataclasses

import numpy as np
from jaxtyping import Array, Int

from ..modes.changed import original_nodal_modes
from ..modes.finite_elements.nodal_modes import NodalModes
from ..modes.finite_elements.soft_supports import ANY_UNIT
from ..modes.flexible_parts import CompliantPart
from .prelude import LogUniform, Modes, Parameter, Scales, field, unit
from .region_stiffness_loss import OnPart

SOFTEST, STIFFEST = 10.0, 1e-6
"""Compliance over that of the structure in the softest pattern of the support: the prior."""


def _unit(support: "SoftSupport") -> str:
    return support.compliance_unit


class SoftSupport(OnPart):
    """A support of a finite element model with a compliance: a foot that rotates, a soft edge.

    Its constraint modes and the modes of the model together span the motion (Craig and Bampton,
    1968, DOI 10.2514/3.4741). A compliance of zero is the support as it was modelled.

    Parameters
    ----------
    support
        Name of the support in `finite_elements.modes(..., soft=...)`, or its number from 0.
    compliance
        Rotation per moment [rad/(N m)], displacement per force [m/N], or along an edge
        displacement per force per length [m2/N].
    compliance_unit
        Which of these it is; on a structure it is that of the support.

    Examples
    --------
    >>> soft = {"foot": bp.finite_elements.soft_supports.springs(matrices, [1])}  # its rotation
    >>> modes = bp.finite_elements.modes(matrices, reading, up_to=500.0, soft=soft)
    >>> beam = bp.Structure(modes, damping=bp.damping.Modal(0.02))
    >>> beam + bp.effects.soft_support("foot", compliance=dist.LogUniform(1e-5, 1e-2))
    Structure: NodalModes, Modal damping, with compliant_support
    """

    absent = ("compliance", 0.0)
    part = "support"
    source = 'finite_elements.modes(..., soft={"foot": soft_supports.rotations(matrices, node)})'
    support: str | int | Int[Array | np.ndarray, ""]
    compliance: Parameter = field(metadata=unit(_unit))
    compliance_unit: str = field(static=True, default=ANY_UNIT, kw_only=True, repr=False)
    name: str = field(static=True, default="compliant_support", kw_only=True)

    @staticmethod
    def names(nodal: NodalModes) -> tuple[str, ...]:
        """Names of all supports that may become soft."""
        return nodal.static_shapes.supports

    def on(self, modes: Modes) -> "SoftSupport":
        """Return the effect with its support by number and the unit of its compliance."""
        found = OnPart.on(self, modes)
        units = original_nodal_modes(modes).static_shapes.compliance_units
        if not units or not isinstance(found.support, int | np.ndarray):
            return found  # a program is compiled for all supports
        return dataclasses.replace(found, compliance_unit=units[int(found.support)])

    def hinges(self, modes: Modes) -> list[CompliantPart]:
        """The support, as a part of the model that becomes softer."""
        return [CompliantPart(self.support, self.compliance)]  # type: ignore[arg-type]

    @classmethod
    def suggest(cls, scales: Scales) -> list["SoftSupport"]:
        """One millionth of the compliance of the structure to ten times as much, for each support.

        The structure is taken in the softest pattern of the support; the other patterns, which
        higher modes feel, are stiffer. Where it follows the support without strain, as beyond the
        only clamp, its inertia at the first natural frequency is taken.
        """
        modes = scales.modes
        priors, _ = compliances(modes)
        return [cls(np.asarray(number), prior).on(modes) for number, prior in enumerate(priors)]


def compliances(modes: Modes) -> tuple[list[LogUniform], list[LogUniform]]:
    """Priors of the compliances of all supports, and of all joints; none of other models."""
    if not isinstance(modes, NodalModes) or not modes.static_shapes.compliant_parts:
        return [], []
    # As the static shapes, of the matrices as given: moduli may be unknown.
    natural = float(np.sqrt(np.asarray(modes.eigenvalues)[modes.rigid_body_modes]))
    stiffness = modes.static_shapes.least_stiffness(natural)
    priors = [LogUniform(STIFFEST / of_part, SOFTEST / of_part) for of_part in stiffness]
    count = len(modes.static_shapes.supports)
    return priors[:count], priors[count:]
