"""A stop with clearance: a spring to the ground that is felt beyond a gap."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from .amplitude_attachment import AmplitudeAttachment, circle_segment, limited_share, tried_places
from .prelude import NOT_NEGATIVE, LogUniform, Omega, Parameter, Scales, at_each, field, unit


class Gap(AmplitudeAttachment):
    """A spring between one place and the ground that is felt beyond a clearance, to both sides.

    Under a harmonic displacement of amplitude a above the clearance g its describing function is
    k (2 / pi) (theta - sin(theta) cos(theta)) with cos(theta) = g / a (Worden and Tomlinson,
    Nonlinearity in Structural Dynamics, ch. 3). The experiment must say how hard it is driven:
    `Experiment(force_levels=...)`.

    Parameters
    ----------
    at, direction
        Where it holds the structure [m], and along which vector; None if it moves along one only.
    stiffness
        Stiffness k of the spring [N/m].
    clearance
        Displacement g to either side at which the spring is reached [m].

    Examples
    --------
    >>> driven = bp.Experiment(structure, **setup, force_levels=[1.0, 10.0])
    >>> stopped = driven + bp.effects.gap(at=0.4, stiffness=1e6, clearance=1e-5)
    >>> stopped.structure.effects["gap"].clearance
    1e-05
    """

    tried_by_default = False
    changes_modes = False
    absent = ("stiffness", 0.0)
    stiffness: Parameter = field(metadata=unit("N/m"))
    clearance: Parameter = field(metadata=unit("m", within=NOT_NEGATIVE))
    name: str = field(static=True, default="gap", kw_only=True)

    def equivalent_stiffness(
        self, amplitude: Float[Array, "actuator frequency"], omega: Omega
    ) -> Float[Array, "actuator frequency"]:
        """Stiffness of the spring, less the more of the motion is in the gap [N/m]."""
        cosine = limited_share(self.threshold(), amplitude)
        return 2 * self.stiffness * circle_segment(cosine)

    def threshold(self) -> Float[Array, ""]:
        """The clearance [m]."""
        return jnp.asarray(self.clearance, float)

    @classmethod
    def suggest(cls, scales: Scales) -> list["Gap"]:
        """A clearance of 1e-3 to 1 times the greatest displacement; none if that is not known."""
        displacement, places = tried_places(scales)
        stiffness = LogUniform(1e-3 * scales.stiffness, 1e3 * scales.stiffness)
        clearance = LogUniform(1e-3 * displacement, displacement)
        return at_each(cls, places, stiffness, clearance)
