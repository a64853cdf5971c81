"""Errors of modes, pieces, channels and runs: a common size times standard normal numbers."""

from collections import OrderedDict
from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.sites import unit
from ..effects.instruments import Instruments
from ..modes.uneven_pieces import Excess, PieceShares

SIDES = ("sensor", "actuator")

OF_WHAT = {
    "frequency": "natural frequencies",
    "damping": "damping",
    "shape": "mode shapes",
    "gain": "sensitivities",
    "stiffness_and_mass": "stiffness and mass along the structure",
    "runs": "natural frequencies from run to run",
}
"""What errors of each kind are of."""


class ErrorsOfModes(eqx.Module):
    """Errors of modes."""

    size: Parameter = eqx.field(metadata=unit("1"))
    """Their common size."""
    standard: Parameter = eqx.field(metadata=unit("1"))
    """Errors over it, standard normal [mode]."""

    def values(self) -> Float[Array, "mode"]:
        """Errors [1]."""
        return jnp.asarray(self.size) * jnp.asarray(self.standard)


class StandardOfPieces(eqx.Module):
    """Errors of the stiffness and of the mass of pieces over their size, standard normal."""

    stiffness: Parameter
    mass: Parameter


class ErrorsOfPieces(eqx.Module):
    """Errors of pieces of a structure."""

    size: Parameter = eqx.field(metadata=unit("1"))
    """Their common size."""
    standard: StandardOfPieces = eqx.field(metadata=unit("1"))
    """Errors over it."""
    shares: PieceShares
    """Share of each piece in the energies between modes."""

    def excess(self) -> Excess:
        """What they add to the modal matrices."""
        pairs = zip((self.standard.stiffness, self.standard.mass), self.shares, strict=True)
        size = jnp.asarray(self.size)
        return Excess(
            *(
                jnp.tensordot(jnp.expm1(size * jnp.asarray(standard)), jnp.asarray(share), 1)
                for standard, share in pairs
            )
        )


class StandardOfChannels(eqx.Module):
    """Errors of channels over their size, standard normal, by the name of the transducer."""

    sensor: OrderedDict[str, Parameter]
    actuator: OrderedDict[str, Parameter]


class ErrorsOfChannels(eqx.Module):
    """Errors of channels."""

    size: Parameter = eqx.field(metadata=unit("1"))
    """Their common size."""
    standard: StandardOfChannels = eqx.field(metadata=unit("1"))
    """Errors over it."""

    def values(self, instruments: Instruments, side: str) -> Float[Array, "channel ..."]:
        """Errors of the channels of a side, in their order [1]."""
        standard = getattr(self.standard, side)
        rows = [jnp.asarray(_of(standard, name)) for name in instruments.side(side)]
        return jnp.asarray(self.size) * jnp.concatenate(rows)


class ErrorsOfRuns(eqx.Module):
    """Errors of modes in the run of each actuator."""

    size: Parameter = eqx.field(metadata=unit("1"))
    """Their common size."""
    standard: OrderedDict[str, Parameter] = eqx.field(metadata=unit("1"))
    """Errors over it, standard normal [mode], by the name of the actuator."""

    def values(self, instruments: Instruments) -> Float[Array, "actuator_channel mode"]:
        """Errors in the run of each channel of the actuators, in their order [1]."""
        rows = [
            jnp.asarray(_of(self.standard, name))
            for name, actuator in instruments.side("actuator").items()
            for _ in actuator.channels
        ]
        return jnp.asarray(self.size) * jnp.stack(rows)


def _of(errors: Mapping[str, Parameter], name: str) -> Parameter:
    if name not in errors:
        raise InputError(
            f'The experiment has a transducer "{name}" that its model error does not know, since '
            "it was made for others. Declare the model error once more: "
            "experiment.with_model_error(bp.model_error.Embedded())."
        )
    return errors[name]
