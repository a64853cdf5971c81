"""A spring between one place of the structure and the ground."""

import numpy as np
from numpyro.distributions import Distribution

from .._shared.dimensions import Parameter
from .prelude import NetworkAttachment, Scales, Spring, at_each, field, negative_log_uniform, unit


class GroundSpring(NetworkAttachment):
    """A spring between one place and the ground: the dynamic stiffness k at every frequency.

    It is negative where a spring of the model is too stiff.

    Parameters
    ----------
    at, direction
        Where it holds the structure [m], and along which vector; None for every motion there is.
    stiffness
        Stiffness [N/m].

    Examples
    --------
    >>> suspended = structure + bp.effects.ground_spring(at=0.1, stiffness=2e4, name="cord")
    >>> list(suspended.effects)
    ['cord']
    """

    absent = ("stiffness", 0.0)
    if_negative = "less than assumed"
    stiffness: Parameter = field(metadata=unit("N/m"))
    name: str = field(static=True, default="ground_spring", kw_only=True)

    def network(self) -> Spring:
        """Return the spring."""
        return Spring(self.stiffness)

    @classmethod
    def suggest(cls, scales: Scales) -> list["GroundSpring"]:
        """A spring of 1e-5 to 100 times the modal stiffness in the middle of the band.

        Where the structure has springs to the ground, they may be softer than assumed: a part of
        their stiffness is missing, at the most all of it.
        """
        priors: list[Distribution] = [scales.any_stiffness]
        least = 1e-5 * scales.stiffness
        assumed = sum(
            float(np.max(effect.stiffness))
            for effect in scales.nominal_effects
            if isinstance(effect, GroundSpring)
        )
        if assumed > least:
            priors.append(negative_log_uniform(least, assumed))
        places = scales.places_and_directions()
        return [effect for prior in priors for effect in at_each(cls, places, prior)]
