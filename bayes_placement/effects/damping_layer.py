"""A layer that damps a part of a bar or beam."""

from collections.abc import Sequence

import jax.numpy as jnp

from .._shared.ranges import NOT_NEGATIVE, POSITIVE, SIGNED_LOSS_FACTOR
from ..modes.changed import original_waveguide, required_waveguide
from ..modes.ports import cuts_over, over
from .effect import AtPlace, Omega, OnPorts, Stiffness, placed
from .prelude import LogUniform, Modes, Parameter, PortLaw, Scales, coordinates, field, unit


class DampingLayer(AtPlace, OnPorts):
    """A modulus E (1 + s eta + i eta) along a segment of a bar or beam, as of a layer upon it.

    Its compliance is less by z / (1 + z) of that of the segment with z = (s + i) eta, which is
    inserted all over it. Oberst, Acustica 2 (1952) 181.

    Parameters
    ----------
    at
        Middle of the segment [m].
    extent
        Its length [m].
    loss_factor
        Loss factor eta that the layer gives to the section [1].
    stiffening
        Stiffness s that it adds, over the loss that it adds [1]: one over the loss factor of its
        material.

    Examples
    --------
    >>> layer = bp.effects.damping_layer(at=0.4, extent=0.2, loss_factor=0.1)
    >>> (structure + layer).effects["damping_layer"].extent
    0.2
    """

    tried_last = takes_long = True
    absent = ("loss_factor", 0.0)
    acts_on = "region"
    extent: Parameter = field(metadata=unit("m", within=POSITIVE))
    loss_factor: Parameter = field(metadata=unit("1", within=SIGNED_LOSS_FACTOR))
    stiffening: Parameter = field(default=0.0, metadata=unit("1", within=NOT_NEGATIVE))
    name: str = field(static=True, default="damping_layer", kw_only=True)

    def on(self, modes: Modes) -> "DampingLayer":
        """Return the effect placed on a uniform bar or beam."""
        required_waveguide(modes, "damping_layer", "Name damping of your own by effects.over.")
        return placed(self, modes)

    def port_laws(self, modes: Modes, modulus: Stiffness, omega: Omega) -> Sequence[PortLaw]:
        """Cuts all over the segment, with the compliance that is gone."""
        segment = over(coordinates(self.at), self.extent, None, modes)
        added = self.loss_factor * (self.stiffening + 1j * jnp.sign(jnp.real(omega)))
        compliance = segment.length / original_waveguide(modes).stiffness
        return [PortLaw(cuts_over(segment, modes), compliance * added * modulus, modulus + added)]

    @classmethod
    def suggest(cls, scales: Scales) -> list["DampingLayer"]:
        """A loss factor of 0.1 % to 100 %, of a material of 0.1 to 100, on any part."""
        loss, stiffening = LogUniform(1e-3, 1.0), LogUniform(1e-2, 10.0)
        parts = scales.extents(lines_alone=True)
        return [cls(place, extent, loss, stiffening) for place, extent in parts]
