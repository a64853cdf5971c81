"""residual_modes: in, a flexibility for each channel pair; out, the receptance that it adds.

Not known here: the structure, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float
from numpyro.distributions import Normal

from .._sites import unit
from .._types import Parameter
from . import _scales
from ._effect import InstrumentEffect, Omega


class ResidualModes(InstrumentEffect):
    """Modes beyond those kept, felt below their resonances as a flexibility of each pair.

    Ewins, Modal Testing, section 4.2: the residual of the modes above the band is constant in
    receptance. Wanted where neither stiffness nor a static solution of the structure is known.

    Parameters
    ----------
    flexibility
        Residual flexibility of each sensor and actuator channel, [sensor, actuator] [m/N].
    """

    absent: ClassVar[tuple[str, float]] = ("flexibility", 0.0)
    flexibility: Parameter = eqx.field(metadata=unit("m/N"))
    name: str = eqx.field(static=True, default="residual_modes", kw_only=True)

    def added(self, omega: Omega) -> Float[Array, "#sensor #actuator #frequency"]:
        """Receptance that it adds [m/N]."""
        return jnp.atleast_2d(jnp.asarray(self.flexibility))[..., None]

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["ResidualModes"]:
        """Normal about zero, as wide as the flexibility about the middle of the band."""
        shape = (len(experiment.sensor_channels), len(experiment.actuator_channels))
        width = 0.1 / _scales.stiffness(experiment)
        return [cls(Normal(jnp.zeros(shape), width).to_event(2))]


residual_modes = ResidualModes
