"""A modulus that is another one all over the structure, as at another temperature."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from .._shared.ranges import CHANGE, negative_log_uniform
from .prelude import LogUniform, Modulus, Omega, Parameter, Scales, field, unit


class ModulusChange(Modulus):
    """A modulus E (1 + change), the same at every frequency and everywhere.

    Between two states of a structure it is mostly that of temperature: steel loses 0.03 % for each
    kelvin, concrete more (Sohn, Phil. Trans. R. Soc. A 365 (2007) 539, DOI
    10.1098/rsta.2006.1935). A single state does not tell it from the modulus itself.

    Parameters
    ----------
    change
        Change of the modulus over the modulus [1].

    Examples
    --------
    >>> warm = bp.effects.modulus_change(-0.02)
    >>> float(warm.relative_modulus(jnp.array([1000.0]))[0])
    -0.02
    """

    absent = ("change", 0.0)
    only_new = True
    in_every_structure = True
    change: Parameter = field(metadata=unit("1", within=CHANGE))
    name: str = field(static=True, default="modulus_change", kw_only=True)

    def relative_modulus(self, omega: Omega) -> Float[Array, "frequency"]:  # type: ignore[override]
        """The change, at all lines [1]."""
        return jnp.broadcast_to(jnp.asarray(self.change, float), jnp.shape(omega))

    @classmethod
    def suggest(cls, scales: Scales) -> list["ModulusChange"]:
        """0.01 % to 50 % stiffer or softer."""
        return [cls(change(1e-4, 0.5)) for change in (LogUniform, negative_log_uniform)]
