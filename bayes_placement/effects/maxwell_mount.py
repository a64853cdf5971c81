"""A mount that is stiff when moved fast and gives way when moved slowly."""

from .effect import NetworkAttachment, at_each
from .prelude import POSITIVE, Dashpot, Law, LogUniform, Parameter, Scales, Spring, field, unit


class MaxwellMount(NetworkAttachment):
    """A spring in series with a dashpot, k i omega tau / (1 + i omega tau): Maxwell's element.

    Ferry, Viscoelastic Properties of Polymers, ch. 3.

    Parameters
    ----------
    at, direction
        Where it holds the structure [m], and along which vector; None for every motion there is.
    stiffness
        Stiffness k of the spring [N/m].
    relaxation_time
        Relaxation time tau, the viscosity over the stiffness [s].

    Examples
    --------
    >>> bp.effects.maxwell_mount(at=0.4, stiffness=2e4, relaxation_time=1e-3).network()
    20000.0 * (Spring(1.0) - Dashpot(0.001))
    """

    tried_by_default = False
    absent = ("stiffness", 0.0)
    stiffness: Parameter = field(metadata=unit("N/m"))
    relaxation_time: Parameter = field(metadata=unit("s", within=POSITIVE))
    name: str = field(static=True, default="maxwell_mount", kw_only=True)

    def network(self) -> Law:
        """Return the spring and the dashpot, of unit stiffness times the stiffness."""
        return self.stiffness * (Spring(1.0) - Dashpot(self.relaxation_time))

    @classmethod
    def suggest(cls, scales: Scales) -> list["MaxwellMount"]:
        """A relaxation at a frequency in the band or a decade outside, anywhere."""
        low, high = scales.band
        time = LogUniform(0.016 / high, 1.6 / low)
        return at_each(cls, scales.places_and_directions(), scales.any_stiffness, time)
