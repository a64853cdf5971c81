"""soft_support: in, a support of a finite element model and a compliance; out, how it gives way.

Not known here: damping, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Int
from numpyro.distributions import LogUniform

from .._sites import unit
from .._types import Parameter
from ..modes.changed import nodal_below
from ..modes.finite_elements.nodal_modes import NodalModes
from ..modes.modes import Modes
from ..modes.yielding import SoftenedSupport
from . import _words
from ._effect import Hinged

SOFTEST, STIFFEST = 10.0, 1e-6
"""Compliance over that of the structure in the softest pattern of the support: the prior."""


class SoftSupport(Hinged):
    """A support of a finite element model that gives way: a foot that turns, a soft edge.

    Its static shapes and the modes of the model together span the motion (Craig and Bampton,
    1968, DOI 10.2514/3.4741). A compliance of zero is the support as it was modelled.

    Parameters
    ----------
    support
        Name of the support in `finite_elements.modes(..., soft=...)`, or its number from 0.
    compliance
        Rotation per moment [rad/(N m)], displacement per force [m/N], or along an edge
        displacement per force per length [m2/N].
    """

    absent: ClassVar[tuple[str, float]] = ("compliance", 0.0)
    support: str | int | Int[Array | np.ndarray, ""]
    compliance: Parameter = eqx.field(metadata=unit("rad/(N m), m/N or m2/N"))
    name: str = eqx.field(static=True, default="compliant_support", kw_only=True)

    def on(self, modes: Modes) -> "SoftSupport":
        """Return it with the number of its support.

        Raises
        ------
        ValueError
            If the structure has no such support.
        """
        if not isinstance(self.support, str):
            return self
        number = nodal_below(modes).statics.support(self.support)
        return type(self)(np.asarray(number), self.compliance, name=self.name)

    def hinges(self, modes: Modes) -> list[SoftenedSupport]:
        """One support that gives way."""
        return [SoftenedSupport(self.support, self.compliance)]  # type: ignore[arg-type]

    def setting(self, experiment: Any) -> str:
        """Which support it is about."""
        nodal = nodal_below(experiment.structure.modes)
        return f"support {_words.among(self.support, nodal.statics.supports)}"

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["SoftSupport"]:
        """None: they are variants of `compliant_support`."""
        return []


soft_support = SoftSupport


def supports_of(modes: Modes) -> list[SoftSupport]:
    """Each support of a model, from one millionth of the compliance of the structure to 10 times.

    The latter in the softest pattern; others, which higher modes feel, are stiffer.
    """
    if not isinstance(modes, NodalModes):
        return []
    return [
        SoftSupport(np.asarray(number), LogUniform(STIFFEST / one, SOFTEST / one))
        for number, one in enumerate(modes.statics.softest())
    ]
