"""A stretch of a uniform bar or beam that has lost stiffness: a crack, a notch."""

import math

import jax.numpy as jnp
import numpy as np

from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.ranges import POSITIVE, SHARE_LOST
from ..modes.beams.waveguide import Waveguide
from ..modes.changed import original_waveguide, required_waveguide
from ..modes.hinges import Hinge
from .effect import AtPlace, Hinged, placed
from .prelude import LogUniform, Modes, Scales, Uniform, field, negative_log_uniform, unit


class LocalStiffnessLoss(AtPlace, Hinged):
    """A share of the bending (axial) stiffness lost along a short stretch: a crack, a notch.

    The flexibility 1 / (E I) grows by loss / (1 - loss) / (E I) along the extent (Friswell and
    Penny, Structural Health Monitoring 1 (2002) 139); two hinges at the Gauss points of the
    stretch carry it.

    Parameters
    ----------
    at
        Middle of the stretch [m].
    extent
        Its length [m].
    loss
        Share of the stiffness that is lost [1]; negative where the stretch is stiffer.

    Examples
    --------
    >>> crack = bp.effects.local_stiffness_loss(
    ...     at=dist.Uniform(0.1, 0.9), extent=0.02, loss=dist.Uniform(0.0, 0.9)
    ... )
    >>> [unknown.name for unknown in (experiment + crack).unknowns_of(crack)]
    ['structure.effects.local_stiffness_loss.at', 'structure.effects.local_stiffness_loss.loss']
    """

    absent = ("loss", 0.0)
    if_negative = "stiffer, not softer"
    acts_on = "cut"
    extent: Parameter = field(metadata=unit("m", within=POSITIVE))
    loss: Parameter = field(metadata=unit("1", within=SHARE_LOST))
    name: str = field(static=True, default="local_stiffness_loss", kw_only=True)

    def on(self, modes: Modes) -> "LocalStiffnessLoss":
        """Return the effect placed on a bar or beam, a segment as the uniform prior over it."""
        instead = "Name a region of the model: effects.region_stiffness_loss(region, loss)."
        waveguide = required_waveguide(modes, "local_stiffness_loss", instead)
        self._check_extent(waveguide.length)
        return placed(self, modes)

    def _check_extent(self, length: Parameter) -> None:
        """Refuse a stretch longer than the structure, as one in mm is."""
        known = isinstance(self.extent, int | float) and isinstance(length, int | float)
        if known and self.extent > length:
            raise InputError(
                f'Effect "{self.name}": an extent of {self.extent:g} m was given, more than the '
                f"length of the structure ({length:g} m); a stretch of it is needed, in metres: "
                "extent=0.02 for 20 mm."
            )

    def hinges(self, modes: Modes) -> list[Hinge]:
        """Two hinges, each with half of the flexibility."""
        waveguide = original_waveguide(modes)
        compliance = self.extent * self.loss / (1 - self.loss) / waveguide.stiffness / 2
        offset = self.extent / (2 * math.sqrt(3))
        places = [jnp.clip(self.at + side * offset, 0.0, waveguide.length) for side in (-1, 1)]
        return [Hinge(place, waveguide.half_order, compliance) for place in places]

    @classmethod
    def suggest(cls, scales: Scales) -> list["LocalStiffnessLoss"]:
        """0.3 % to 95 % lost along 1 % to 10 % of a uniform bar or beam, or up to 100 % added.

        What is added is shorter than a third of the least half-wave and not at an end: hinges of
        negative compliance have no natural frequencies else.
        """
        if not isinstance(scales.modes, Waveguide):
            return []
        length = scales.modes.bounds()[1]
        extent, loss = LogUniform(0.01 * length, 0.1 * length), LogUniform(0.003, 0.95)
        line_length = float(np.ptp(scales.nominal_modes.bounds()))
        half_wave = line_length / len(scales.modes.wave_numbers)
        longest = min(half_wave / 3, 0.1 * line_length)
        inside = Uniform(longest, line_length - longest)
        short, gain = LogUniform(0.2 * longest, longest), negative_log_uniform(0.003, 1.0)
        return [*(cls(place, extent, loss) for place in scales.places()), cls(inside, short, gain)]
