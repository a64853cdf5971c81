"""A tuned mass damper on one place of the structure."""

import jax.numpy as jnp

from .._shared.ranges import POSITIVE, SHARE_OF_CRITICAL
from ..laws import Dashpot, Law, Mass, Spring
from .prelude import LogUniform, NetworkAttachment, Parameter, Scales, at_each, field, unit


class TunedAbsorber(NetworkAttachment):
    """A mass on a spring and a dashpot in parallel, attached at one place.

    Den Hartog, Mechanical Vibrations, section 3.3: with s = k + i omega c, the force per
    displacement of its foot is -omega^2 m s / (s - omega^2 m).

    Parameters
    ----------
    at, direction
        Where its foot sits [m], and along which vector it acts; None for every motion there is.
    mass
        Mass [kg].
    frequency, damping_ratio
        Natural frequency [Hz] and damping ratio [1] on a fixed foot.

    Examples
    --------
    >>> absorber = bp.effects.tuned_absorber(0.4, mass=0.1, frequency=170.0, damping_ratio=0.1)
    >>> (structure + absorber).effects["tuned_absorber"].frequency
    170.0
    """

    absent = ("mass", 0.0)
    mass: Parameter = field(metadata=unit("kg"))
    frequency: Parameter = field(metadata=unit("Hz", within=POSITIVE))
    damping_ratio: Parameter = field(metadata=unit("1", within=SHARE_OF_CRITICAL))
    name: str = field(static=True, default="tuned_absorber", kw_only=True)

    def network(self) -> Law:
        """Return the mass on a spring and a dashpot, of one kilogram times the mass."""
        natural = 2 * jnp.pi * self.frequency
        foot = Spring(natural**2) | Dashpot(2 * self.damping_ratio * natural)
        return self.mass * (foot - Mass(1.0))

    @classmethod
    def suggest(cls, scales: Scales) -> list["TunedAbsorber"]:
        """An absorber of 0.001 % to 30 % of the mass, tuned within the band, anywhere."""
        mass = LogUniform(scales.least_mass, 0.3 * scales.mass)
        numbers = mass, LogUniform(*scales.band), LogUniform(0.003, 0.3)
        return at_each(cls, scales.places_and_directions(), *numbers)
