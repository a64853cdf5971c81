"""Channels whose record may have a factor that is missing: each by itself, and all together."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ...effects.butterworth import LowPass
from ...effects.on_transducer import OnTransducer, channels
from ...experiment.experiment import Experiment
from ._filters import FilterRows
from ._free_factor import FreeFactor, Responses

CHANNELS = ("channel", "all_channels")
"""What a factor acts on, as results say it."""

NOWHERE = (*CHANNELS, "structure")
"""What is at no place: what acts on all of the structure changes its modulus."""

SIDES = ("sensor", "actuator")


class ChannelPort(NamedTuple):
    """What a port is for a law, for a factor: some channels.

    `acts_on` is `channel` or `all_channels`; the effect, a filter there that does nothing, says
    which.
    """

    acts_on: str
    effect: OnTransducer

    @property
    def is_cut(self) -> bool:
        """Whether laws are inserted."""
        return False

    @property
    def unit(self) -> str:
        """Unit of a factor."""
        return "1"

    def effect_in(self, experiment: Experiment) -> OnTransducer:
        """Return the effect that says where it is."""
        return self.effect.numbered(experiment.instruments)

    def setting(self, experiment: Experiment) -> str:
        """Name of the channel."""
        if self.acts_on == "all_channels":
            return "all channels"
        effect = self.effect_in(experiment)
        return effect.setting(experiment.structure.modes, experiment.instruments)

    def rows(self, free: FreeFactor, omega: Float[np.ndarray, "frequency"]) -> FilterRows:
        """Filters that may be there."""
        return FilterRows(omega, self.effect.side == "actuator")


def channels_of(experiment: Experiment) -> list[ChannelPort]:
    """Each channel of a side that has several, and all FRFs."""
    instruments = experiment.instruments
    each = [
        (name, side, direction)
        for side in SIDES
        for name, direction in channels(instruments, side)
        if len(instruments.channels(side)) > 1
    ]
    ports = [ChannelPort("channel", _nothing(*channel)) for channel in each]
    return [*ports, ChannelPort("all_channels", _nothing(None, "sensor", None))]


def free_factor(port: ChannelPort, responses: Responses) -> FreeFactor:
    """The factor on its channels, free at each line."""
    experiment = responses.problem.experiment
    affected = port.effect_in(experiment).affected(experiment.instruments)
    return FreeFactor(responses, np.asarray(affected))


def _nothing(transducer: str | None, side: str, direction: int | None) -> LowPass:
    return LowPass(transducer, np.inf, side=side, direction=direction)
