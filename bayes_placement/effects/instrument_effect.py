"""What an effect on the instruments of an experiment is: its places, its loads, its record."""

from collections.abc import Callable
from typing import ClassVar, NamedTuple, TypeAlias, TypeVar

import jax.numpy as jnp
from jaxtyping import Array, Float, Inexact

from .._shared.dimensions import Receptance
from ..modes.modes import Modes
from .effect import Effect, Omega, Stiffness
from .instruments import Instruments

Self = TypeVar("Self", bound="InstrumentEffect")

Factor: TypeAlias = Inexact[Array, "#sensor #actuator #frequency"]
"""Factor on the FRFs of channels at frequencies [1]."""


class Alone(NamedTuple):
    """An effect on a few transducers, as the only ones of their side."""

    effect: Effect
    """The effect, its transducers by their numbers among these."""
    side: str
    """`sensor` or `actuator`."""
    names: tuple[str, ...]
    """Their names, in the order of the experiment."""


class InstrumentEffect(Effect):
    """An effect that belongs to the measurement: added by `experiment + effect`.

    It may act on sensors, on actuators, or on both: on their places (`moved`), on the dynamic
    stiffness that they add to the structure (`loads`, `load`), on the receptance (`evaluated`,
    `added`) and on the record (`laplace`, `channel_factor`, `recorded`). A method that is not
    overridden changes nothing.

    Attributes
    ----------
    loads
        Sides that load the structure where they sit: `sensor`, `actuator`, both or none.

    Examples
    --------
    >>> kinds = bp.effects.EFFECTS.items()
    >>> [name for name, kind in kinds if issubclass(kind, bp.effects.InstrumentEffect)]
    ['residual_modes', 'further_mode', 'sensor_mass', 'actuator_mass', 'stinger',
    'exponential_window', 'time_delay', 'channel_delay', 'gain_error', 'mount_resonance',
    'misplaced_sensor', 'misplaced_actuator', 'reversed_sensor', 'reversed_channel',
    'swapped_sensors', 'swapped_actuators', 'frequency_drift', 'low_pass', 'high_pass',
    'phase_drift', 'cross_axis', 'frequency_scale', 'mains_hum']
    """

    acts_on: ClassVar[str] = "channel"
    loads: ClassVar[tuple[str, ...]] = ()

    def numbered(self: Self, instruments: Instruments) -> Self:
        """Return the effect with its transducers by number, or refuse those that do not fit."""
        return self

    def alone(self, instruments: Instruments) -> Alone | None:
        """Return it in an experiment that has the transducers alone whose FRFs it changes.

        None where it changes those of all.
        """
        return None

    def moved(self, instruments: Instruments, modes: Modes) -> Instruments:
        """Return the instruments where they truly sat."""
        return instruments

    def load(self, side: str, number: int, omega: Omega) -> Stiffness:
        """Dynamic stiffness [N/m] that a transducer brings to the structure, in every direction.

        It is told by its number among those of its side, `sensor` or `actuator`, from 0.
        """
        return jnp.zeros(omega.shape)

    def laplace(self, omega: Omega) -> Omega:
        """Variable s / i at which the record is evaluated, in the place of omega [rad/s]."""
        return omega

    def evaluated(
        self, respond: Callable[[Omega], Receptance], omega: Omega, instruments: Instruments
    ) -> Receptance:
        """Receptance [m/N] that the structure had while it was recorded.

        Without this effect it responds as given at any angular frequencies.
        """
        return respond(omega)

    def added(self, omega: Omega) -> Float[Array, "#sensor #actuator #frequency"]:
        """Receptance [m/N] that the structure has besides that of its modes."""
        return jnp.zeros((1, 1, 1))

    def channel_factor(self, omega: Omega, instruments: Instruments) -> Factor | None:
        """Return the factor on each recorded FRF [1]; None where there is none.

        `instruments.of(name, side)` is 1 on the channels of one transducer.
        """
        return None

    def recorded(self, frf: Receptance, omega: Omega, instruments: Instruments) -> Receptance:
        """FRF as it was recorded, by default that of the structure times `channel_factor`."""
        factor = self.channel_factor(omega, instruments)
        return frf if factor is None else frf * factor
