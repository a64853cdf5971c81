"""A cubic spring between one place of the structure and the ground."""

from jaxtyping import Array, Float

from .amplitude_attachment import AmplitudeAttachment, tried_places
from .prelude import LogUniform, Omega, Parameter, Scales, at_each, field, unit


class CubicStiffness(AmplitudeAttachment):
    """A cubic spring between one place and the ground, by its describing function.

    Under a harmonic displacement of amplitude u the force k_3 u^3 has the first harmonic
    3/4 k_3 u^3 (Worden and Tomlinson, Nonlinearity in Structural Dynamics, ch. 3), so that the
    equivalent stiffness is 3/4 k_3 u^2, and u itself follows from it. The experiment must say how
    hard it is driven: `Experiment(force_levels=...)`.

    Parameters
    ----------
    at, direction
        Where it holds the structure [m], and along which vector; None if it moves along one only.
    stiffness
        Force per cube of displacement [N/m^3].

    Examples
    --------
    >>> driven = bp.Experiment(structure, **setup, force_levels=[1.0, 10.0])
    >>> list((driven + bp.effects.cubic_stiffness(at=0.4, stiffness=1e13)).structure.effects)
    ['cubic_stiffness']
    """

    changes_modes = False
    absent = ("stiffness", 0.0)
    stiffness: Parameter = field(metadata=unit("N/m3"))
    name: str = field(static=True, default="cubic_stiffness", kw_only=True)

    def equivalent_stiffness(
        self, amplitude: Float[Array, "actuator frequency"], omega: Omega
    ) -> Float[Array, "actuator frequency"]:
        """3/4 k_3 a^2 at the amplitude a [N/m]."""
        return 0.75 * self.stiffness * amplitude**2

    @classmethod
    def suggest(cls, scales: Scales) -> list["CubicStiffness"]:
        """A spring that matters at the amplitudes of this experiment; none without them."""
        displacement, places = tried_places(scales)
        middle = scales.stiffness / displacement**2
        stiffness = LogUniform(1e-4 * middle, 1e4 * middle)
        return at_each(cls, places, stiffness)
