"""A modulus that relaxes, and so depends on frequency."""

import math

from jaxtyping import Array, Complex

from .prelude import POSITIVE, LogUniform, Modulus, Omega, Parameter, Scales, field, unit


class ViscoelasticModulus(Modulus):
    """A standard linear solid, E (1 + delta i omega tau / (1 + i omega tau)).

    Ferry, Viscoelastic Properties of Polymers, ch. 3: a spring parallel to a Maxwell element.

    Parameters
    ----------
    relaxing
        Share delta of the modulus that relaxes, over the static modulus [1].
    relaxation_time
        Relaxation time tau [s].

    Examples
    --------
    >>> rubber = bp.effects.viscoelastic_modulus(relaxing=0.5, relaxation_time=1e-3)
    >>> complex(rubber.relative_modulus(jnp.array([1000.0]))[0])  # at omega tau = 1
    (0.25+0.25j)
    """

    absent = ("relaxing", 0.0)
    relaxing: Parameter = field(metadata=unit("1"))
    relaxation_time: Parameter = field(metadata=unit("s", within=POSITIVE))
    name: str = field(static=True, default="viscoelastic_modulus", kw_only=True)

    def relative_modulus(self, omega: Omega) -> Complex[Array, "frequency"]:
        """Relaxing part, delta i omega tau / (1 + i omega tau) [1]."""
        rate = 1j * omega * self.relaxation_time
        return self.relaxing * rate / (1 + rate)

    @classmethod
    def suggest(cls, scales: Scales) -> list["ViscoelasticModulus"]:
        """A modulus that relaxes by 0.1 % to 100 %, at a rate in the band or a decade outside."""
        low, high = scales.band
        times = LogUniform(0.1 / (2 * math.pi * high), 10 / (2 * math.pi * low))
        return [cls(LogUniform(1e-3, 1.0), times)]
