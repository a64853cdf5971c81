"""A body whose centre of mass lies beside the place where it is fixed."""

from collections.abc import Mapping, Sequence

import jax.numpy as jnp
from numpyro.distributions import LogUniform, Uniform

from ..modes.ports import beside, rotation
from ..positions.places import Value
from .effect import AtPlace, Omega, OnPorts, Stiffness, bending_scale
from .prelude import NOT_NEGATIVE, Mass, Modes, Parameter, PortLaw, Scales, coordinates, field, unit


class EccentricMass(AtPlace, OnPorts):
    """A rigid body on a beam, with a rotary inertia and its centre of mass beside its foot.

    Its matrix over deflection and slope is m [[1, e], [e, r^2 + e^2]]: a mass m on the deflection
    of its centre, w + e w', and an inertia m r^2 on the slope (Blevins, Formulas for Natural
    Frequency and Mode Shape, table 8-8).

    Parameters
    ----------
    at
        Where its foot is [m].
    mass
        Mass m [kg].
    radius_of_gyration
        Radius of gyration r about its centre of mass [m].
    offset
        Distance e of the centre of mass from the foot along the beam [m].

    Examples
    --------
    >>> body = bp.effects.eccentric_mass(0.4, mass=0.2, radius_of_gyration=0.03, offset=0.02)
    >>> body.offset
    0.02
    """

    absent = ("mass", 0.0)
    acts_on = "body"
    mass: Parameter = field(metadata=unit("kg"))
    radius_of_gyration: Parameter = field(metadata=unit("m", within=NOT_NEGATIVE))
    offset: Parameter = field(metadata=unit("m"), default=0.0)
    name: str = field(static=True, default="eccentric_mass", kw_only=True)

    def port_laws(self, modes: Modes, modulus: Stiffness, omega: Omega) -> Sequence[PortLaw]:
        """The mass at its centre, and the inertia on the slope."""
        at = coordinates(self.at)
        inertia = self.mass * jnp.asarray(self.radius_of_gyration) ** 2
        return [
            PortLaw(beside(at, self.offset, modes), *Mass(self.mass).fraction(omega)),
            PortLaw(rotation(at, None, None, modes), *Mass(inertia).fraction(omega)),
        ]

    def twin(self, values: Mapping[str, Value]) -> Mapping[str, Value]:
        """The same centre of mass, held from its other side."""
        if "at" not in values or "offset" not in values:
            return {}
        return {"at": values["at"] + 2 * values["offset"], "offset": -values["offset"]}

    @classmethod
    def suggest(cls, scales: Scales) -> list["EccentricMass"]:
        """0.001 % to 100 % of the mass of a uniform beam, within a tenth of its length."""
        length, _, places = bending_scale(scales)
        mass = LogUniform(scales.least_mass, scales.mass)
        radius = LogUniform(1e-3 * length, 0.3 * length)
        offset = Uniform(-0.1 * length, 0.1 * length)
        return [cls(place, mass, radius, offset) for place in places]
