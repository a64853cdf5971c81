"""Dry friction between one place of the structure and the ground."""

import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from .._shared.ranges import NOT_NEGATIVE, POSITIVE
from .amplitude_attachment import AmplitudeAttachment, circle_segment, limited_share, tried_places
from .prelude import LogUniform, Omega, Parameter, Scales, at_each, field, unit


class CoulombFriction(AmplitudeAttachment):
    """A contact that slips at a force, in series with its stiffness: Jenkins' element.

    It sticks up to the amplitude F / k. Beyond, its describing function is k r' + i k r'' with
    s = F / (k a), r' = (theta - sin(theta) cos(theta)) / pi, cos(theta) = 1 - 2 s and
    r'' = 4 s (1 - s) / pi: a cycle loses 4 F (a - F / k) (Krack and Gross, Harmonic Balance for
    Nonlinear Vibration Problems, doi:10.1007/978-3-030-14023-6). Without a force nothing is left
    of it. The experiment must say how hard it is driven: `Experiment(force_levels=...)`.

    Parameters
    ----------
    at, direction
        Where it holds the structure [m], and along which vector; None if it moves along one only.
    force
        Force F at which it slips [N].
    stiffness
        Stiffness k of the contact while it sticks [N/m].

    Examples
    --------
    >>> driven = bp.Experiment(structure, **setup, force_levels=[1.0, 10.0])
    >>> rubbing = driven + bp.effects.coulomb_friction(at=0.4, force=0.5, stiffness=1e6)
    >>> float(rubbing.structure.effects["coulomb_friction"].threshold())  # m
    5e-07
    """

    tried_by_default = False
    changes_modes = False
    # The force and not the stiffness: weak friction loses energy, a weak contact is a spring.
    absent = ("force", 0.0)
    force: Parameter = field(metadata=unit("N", within=NOT_NEGATIVE))
    stiffness: Parameter = field(metadata=unit("N/m", within=POSITIVE))
    name: str = field(static=True, default="coulomb_friction", kw_only=True)

    def equivalent_stiffness(
        self, amplitude: Float[Array, "actuator frequency"], omega: Omega
    ) -> Complex[Array, "actuator frequency"]:
        """That of the contact, less the more it slips [N/m]; conjugate at negative frequencies."""
        share = limited_share(self.threshold(), amplitude)
        lost = 4 * share * (1 - share) / jnp.pi * jnp.sign(omega)
        return self.stiffness * (circle_segment(1 - 2 * share) + 1j * lost)

    def threshold(self) -> Float[Array, ""]:
        """Amplitude at which it slips [m]."""
        return jnp.asarray(self.force / self.stiffness)

    @classmethod
    def suggest(cls, scales: Scales) -> list["CoulombFriction"]:
        """Forces that matter at the amplitudes of this experiment; none if these are not known."""
        displacement, places = tried_places(scales)
        greatest = scales.stiffness * displacement
        force = LogUniform(1e-4 * greatest, greatest)
        stiffness = LogUniform(1e-2 * scales.stiffness, 1e2 * scales.stiffness)
        return at_each(cls, places, force, stiffness)
