"""What every attachment is whose stiffness depends on the amplitude of its place."""

import abc
from collections.abc import Iterable, Sequence
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Inexact

from .effect import AtPlace, Direction, Effect, Omega
from .scales import Axis, Scales


class AmplitudeAttachment(AtPlace):
    """An attachment whose stiffness depends on the amplitude of its place, along one direction.

    Its law is a describing function: force over displacement, of the first harmonic. A structure
    can have one such attachment, of whatever kind.

    Examples
    --------
    >>> kinds = bp.effects.EFFECTS.items()
    >>> [name for name, kind in kinds if issubclass(kind, bp.effects.AmplitudeAttachment)]
    ['cubic_stiffness', 'coulomb_friction', 'gap']
    """

    may_repeat: ClassVar[bool] = False  # their describing functions would depend on each other
    direction: Direction = eqx.field(default=None, kw_only=True)

    @abc.abstractmethod
    def equivalent_stiffness(
        self, amplitude: Float[Array, "actuator frequency"], omega: Omega
    ) -> Inexact[Array, "actuator frequency"]:
        """Dynamic stiffness at an amplitude [N/m], finite at zero as well.

        Its magnitude below an amplitude is at most that there, or that at the threshold.

        Parameters
        ----------
        amplitude
            Amplitude of the displacement [m].
        omega
            Angular frequencies [rad/s].
        """

    def threshold(self) -> Float[Array, ""]:
        """Amplitude up to which the dynamic stiffness is constant [m]."""
        return jnp.zeros(())


def can_act_together(effects: Iterable[Effect]) -> bool:
    """Tell whether a structure can have all of some effects: one of those of amplitude at most."""
    return sum(isinstance(effect, AmplitudeAttachment) for effect in effects) <= 1


def limited_share(
    limit: Float[Array, ""], amplitude: Float[Array, "*shape"]
) -> Float[Array, "*shape"]:
    """Limit over an amplitude, and one where the amplitude is less; zero without a limit [1]."""
    is_beyond = amplitude > limit
    return jnp.where(is_beyond, limit / jnp.where(is_beyond, amplitude, 1.0), jnp.sign(limit))


def circle_segment(cosine: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Area of a circle beyond a chord, (theta - sin(theta) cos(theta)) / pi of the whole [1].

    Where all or nothing is beyond the chord the slope is zero, which that of the angle is not.
    """
    is_cut = jnp.abs(cosine) < 1
    angle = jnp.arccos(jnp.where(is_cut, cosine, 0.0))
    return jnp.where(is_cut, (angle - 0.5 * jnp.sin(2 * angle)) / jnp.pi, 1.0 * (cosine < 0))


def tried_places(scales: Scales) -> tuple[float, Sequence[tuple[object, Axis]]]:
    """Greatest displacement [m], and places with directions; 1 m and none where it is not known.

    None either where the structure has an attachment of this kind, beside which no other can be.
    """
    is_taken = any(isinstance(item, AmplitudeAttachment) for item in scales.nominal_effects)
    displacement = scales.displacement
    if displacement is None or is_taken:
        return 1.0, []
    return displacement, scales.places_and_directions()
