"""modes: in, whatever describes a structure; out, natural frequencies and mass-normalised shapes.

Not known here: damping, sensors, probability.
"""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float


class Modes(eqx.Module):
    """Natural frequencies and mass-normalised mode shapes, readable at any point."""

    axes: eqx.AbstractVar[tuple[int, ...]]
    rigid_body_modes: eqx.AbstractVar[int]

    @abc.abstractmethod
    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies [rad/s], rigid-body modes first with 0."""

    @abc.abstractmethod
    def shapes(self, position: Float[Array, "*coordinate"]) -> Float[Array, "axis mode"]:
        """Mass-normalised mode shapes [kg^-1/2] along `axes` at a position [m]."""

    @abc.abstractmethod
    def bounds(self) -> tuple[float, float]:
        """Return the least and the greatest position on the structure [m]."""

    @property
    def natural_frequency(self) -> Float[Array, "mode"]:
        """Natural frequencies [Hz]."""
        return self.angular_frequency() / (2 * jnp.pi)
