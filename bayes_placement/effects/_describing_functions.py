"""What laws that depend on the amplitude have in common."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from .amplitude_attachment import AmplitudeAttachment
from .scales import Axis, Scales


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


def tried_places(scales: Scales) -> tuple[float, list[tuple[Any, Axis]]]:
    """Greatest displacement [m], and places with directions; 1 m and none where it is not known.

    None either where the structure has an attachment of this kind, beside which no other can be.
    """
    is_taken = any(isinstance(item, AmplitudeAttachment) for item in scales.nominal_effects)
    displacement = scales.displacement
    if displacement is None or is_taken:
        return 1.0, []
    return displacement, scales.places_and_directions()
