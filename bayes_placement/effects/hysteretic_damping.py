"""Damping of the material, independent of frequency."""

import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from .prelude import SIGNED_LOSS_FACTOR, LogUniform, Modulus, Omega, Parameter, Scales, field, unit


class HystereticDamping(Modulus):
    """A complex modulus E (1 + i eta), in the place of the damping as drawn.

    The loss factor eta is the same at every frequency (Bert, J. Sound Vib. 29 (1973) 129).

    Parameters
    ----------
    loss_factor
        Loss factor [1].
    share
        Share of the damping as drawn that it replaces [1].

    Examples
    --------
    >>> (structure + bp.effects.hysteretic_damping(loss_factor=0.02, share=1.0)).effects
    OrderedDict([('hysteretic_damping', HystereticDamping(loss_factor=0.02))])
    """

    absent = ("share", 0.0)
    loss_factor: Parameter = field(metadata=unit("1", within=SIGNED_LOSS_FACTOR))
    share: Parameter = field(metadata=unit("1"), default=1.0)
    name: str = field(static=True, default="hysteretic_damping", kw_only=True)

    def relative_modulus(self, omega: Omega) -> Complex[Array, "frequency"]:
        """Imaginary part eta of the modulus times the share, conjugate at negative frequencies."""
        return 1j * self.share * self.loss_factor * jnp.sign(jnp.real(omega))

    def kept_damping(self) -> Float[Array, ""]:
        """Share of the damping as drawn that it does not replace [1]."""
        return 1 - jnp.asarray(self.share)

    @classmethod
    def suggest(cls, scales: Scales) -> list["HystereticDamping"]:
        """A loss factor of 0.1 % to 30 %."""
        return [cls(LogUniform(1e-3, 0.3))]
