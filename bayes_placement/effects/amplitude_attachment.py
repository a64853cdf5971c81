"""What every attachment is whose stiffness depends on the amplitude of its place."""

import abc
from collections.abc import Iterable
from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float, Inexact

from .effect import AtPlace, Effect, Omega


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
