"""Flexibility of modes above the band that the model leaves out."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import Normal

from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.sites import is_unknown, unit
from .prelude import OF_CHANNELS, InstrumentEffect, Instruments, Omega, Scales, field


class ResidualModes(InstrumentEffect):
    """Modes above the band: a constant flexibility between each sensor and actuator channel.

    Ewins, Modal Testing, section 4.2: the residual of the modes above the band is constant in
    receptance. Needed where neither stiffness nor a static solution of the structure is known.

    Parameters
    ----------
    flexibility
        Residual flexibility of each sensor and actuator channel, [sensor, actuator] [m/N].

    Examples
    --------
    >>> stiffer = experiment + bp.effects.residual_modes(flexibility=np.array([[1e-8]]))
    >>> [effect.name for effect in stiffer.effects]
    ['residual_modes']
    """

    changes_modes = False
    absent = ("flexibility", 0.0)
    flexibility: Parameter = field(metadata=unit("m/N") | {OF_CHANNELS: True})
    name: str = field(static=True, default="residual_modes", kw_only=True)

    def numbered(self, instruments: Instruments) -> "ResidualModes":
        """Return the effect as it is."""
        check_one_each(self.name, "flexibility", self.flexibility, instruments)
        return self

    def added(self, omega: Omega) -> Float[Array, "#sensor #actuator #frequency"]:
        """Receptance that it adds [m/N]."""
        return jnp.atleast_2d(jnp.asarray(self.flexibility))[..., None]

    @classmethod
    def suggest(cls, scales: Scales) -> list["ResidualModes"]:
        """Normal about zero, as wide as the flexibility about the middle of the band."""
        shape = tuple(len(scales.instruments.channels(side)) for side in ("sensor", "actuator"))
        width = 0.1 / scales.stiffness
        return [cls(Normal(np.zeros(shape), width).to_event(2))]


def check_one_each(name: str, word: str, value: Parameter, instruments: Instruments) -> None:
    """Refuse a field that is neither one number nor one for each pair of channels."""
    shape = tuple(value.shape()) if is_unknown(value) else np.shape(value)
    needed = tuple(len(instruments.channels(side)) for side in ("sensor", "actuator"))
    if shape not in ((), needed):
        of_all = 0.0 if is_unknown(value) else float(np.mean(value))
        raise InputError(
            f'Effect "{name}": {word} of shape {shape} was given; one number or the shape {needed} '
            "is needed, since each pair of a sensor and an actuator channel has its own: "
            f"{word}=np.full({needed}, {of_all:.3g})."
        )
