"""A law of any kind by which the modulus depends on frequency."""

from jaxtyping import Array, Complex

from .._shared.sites import LAW_UNITS, OF_MODULUS
from .attached import GivenLaw
from .prelude import Law, Modulus, Omega, Parameter, field, unit


class ModulusLaw(GivenLaw, Modulus):
    """A modulus E (1 + Z) of the whole structure, with a law Z of springs and dashpots.

    A springpot makes it a fractional one (Bagley and Torvik, AIAA J. 21 (1983) 741,
    doi:10.2514/3.8142), a lossy spring a hysteretic one.

    Parameters
    ----------
    law
        What is added to the modulus as drawn, over it: stiffnesses in 1 for N/m, viscosities in s
        for N s/m.
    strength
        Factor on the law [1].

    Examples
    --------
    >>> rubber = bp.effects.modulus(bp.effects.Springpot(dist.LogUniform(1e-3, 1.0), 0.5, 300.0))
    >>> list((experiment + rubber).unknown)[1]
    'structure.effects.modulus.law.stiffness'
    """

    law: Law = field(metadata={LAW_UNITS: lambda effect: OF_MODULUS})
    strength: Parameter = field(metadata=unit("1"), default=1.0)
    name: str = field(static=True, default="modulus", kw_only=True)

    @property
    def kind(self) -> str:
        """Name of its kind, which is that of the network."""
        return f"modulus: {self.law.in_words()}"

    def relative_modulus(self, omega: Omega) -> Complex[Array, "frequency"]:
        """What the law adds [1]."""
        return self.network().dynamic_stiffness(omega) + 0j
