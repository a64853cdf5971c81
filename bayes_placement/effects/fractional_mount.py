"""A mount of rubber, between a spring and a dashpot."""

import math

import equinox as eqx
from numpyro.distributions import LogUniform, Uniform

from .effect import Direction, NetworkAttachment, Place, at_each
from .prelude import ORDER, POSITIVE, Parameter, Scales, Springpot, unit


class FractionalMount(NetworkAttachment):
    """A springpot, k (i omega / omega_0)^order: its stiffness and loss grow with the frequency.

    Bagley and Torvik, AIAA Journal 21 (1983) 741, DOI 10.2514/3.8142.

    Parameters
    ----------
    at
        Where it holds the structure [m].
    stiffness
        Magnitude k of the dynamic stiffness at the reference frequency [N/m].
    order
        Order from 0, a spring, to 1, a dashpot [1].
    frequency
        Reference frequency omega_0 / (2 pi) [Hz].
    direction
        Direction in which it acts, three numbers; None for every one in which the structure moves.

    Examples
    --------
    >>> mount = bp.effects.fractional_mount(at=0.4, stiffness=2e4, order=0.3, frequency=100.0)
    >>> abs(complex(mount.dynamic_stiffness(jnp.array([2 * np.pi * 100.0]))[0])).__round__(6)
    20000.0
    """

    tried_by_default = False
    absent = ("stiffness", 0.0)
    at: Place = eqx.field(metadata=unit("m"))
    stiffness: Parameter = eqx.field(metadata=unit("N/m"))
    order: Parameter = eqx.field(metadata=unit("1", within=ORDER))
    frequency: Parameter = eqx.field(metadata=unit("Hz", within=POSITIVE))
    direction: Direction = eqx.field(default=None, kw_only=True)
    name: str = eqx.field(static=True, default="fractional_mount", kw_only=True)

    def network(self) -> Springpot:
        """Return the springpot."""
        return Springpot(self.stiffness, self.order, self.frequency)

    @classmethod
    def suggest(cls, scales: Scales) -> list["FractionalMount"]:
        """Any order, of 1e-5 to 100 times the modal stiffness in the middle of the band."""
        stiffness = LogUniform(1e-5 * scales.stiffness, 1e2 * scales.stiffness)
        middle = scales.angular_frequency / (2 * math.pi)
        numbers = {"stiffness": stiffness, "order": Uniform(0.0, 1.0), "frequency": middle}
        return at_each(cls, scales.places_and_directions(), **numbers)
