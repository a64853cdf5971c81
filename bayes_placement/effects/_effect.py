"""_effect: in, nothing; out, what every effect is, by the place where it enters the response.

Not known here: any single effect, data, probability.
"""

import abc
from collections.abc import Sequence
from typing import Any, ClassVar, TypeAlias, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float, Inexact, Int

from .._sites import is_unknown
from .._types import InputError, Parameter, Receptance
from ..modes.hinged import Hinge
from ..modes.modes import Modes
from ..modes.points import Points, along
from ..modes.yielding import Yielding
from ..positions import placed as _placed
from ..positions.channel import Channel
from ..positions.places import Place as InSpace
from ..positions.places import Position, coordinates
from ..positions.tolerances import Support
from . import _words

Omega = Inexact[Array, "frequency"]
Stiffness = Inexact[Array, "frequency"]
Place: TypeAlias = _placed.At
Direction: TypeAlias = tuple[Any, Any, Any] | None
"""Three numbers; None for every direction in which the structure moves."""
Numbered: TypeAlias = str | int | Int[Array | np.ndarray, ""]
"""Name of a sensor, or its number from 0 once the effect is part of an experiment."""

Sensors = Any  # sensors by name, in their order
Self = TypeVar("Self", bound="Effect")


class Effect(eqx.Module):
    """A physical effect that a structure or its measuring chain may have.

    With a strength of zero it is exactly the identity: the same object serves inference, where
    its strength is sampled, and ranking, where the response to a small strength is its signature.
    `absent` names the field that is the strength and its value there, which is zero for most.
    """

    absent: eqx.AbstractClassVar[tuple[str, float]]
    name: eqx.AbstractVar[str]

    @classmethod
    @abc.abstractmethod
    def suggest(cls, experiment: Any) -> Sequence["Effect"]:
        """Variants to be tried on an experiment, with priors scaled to its structure."""

    def on(self: Self, modes: Modes) -> Self:
        """Return it placed on a structure; an effect without a place stays as it is."""
        return self

    def setting(self, experiment: Any) -> str:
        """Say which place, sensor or part of the structure it is about, as in `sensor s3`.

        Empty where there is only one; what is unknown is a parameter, and not said.
        """
        return ""


class StructureEffect(Effect):
    """An effect that belongs to the structure: added by `structure + effect`."""


class AtPlace(StructureEffect):
    """An effect at one place of the structure, along one direction or felt in every one."""

    at: eqx.AbstractVar[Place]

    @property
    def direction(self) -> Direction:
        """Direction in which it acts; None for every one in which the structure moves."""
        return None

    def on(self: Self, modes: Modes) -> Self:
        """Return it placed on a structure, a support as the uniform law over it."""
        law = placed(self.at, modes, self.name)  # type: ignore[attr-defined]
        return eqx.tree_at(lambda one: one.at, self, law, is_leaf=is_place)

    def setting(self, experiment: Any) -> str:
        """Which piece of the structure it sits on, and the direction in which it acts."""
        piece = _words.place(self.at, experiment.structure.modes.bounds())
        return _words.together(piece, _words.along(self.direction))

    def points(self, modes: Modes) -> Points:
        """Where the structure feels it, and along what."""
        return along(coordinates(self.at), self.direction, modes)


class Attachment(AtPlace):
    """Something attached to the structure, felt by it as a dynamic stiffness at one place."""

    @abc.abstractmethod
    def dynamic_stiffness(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness [N/m], force on the attachment per displacement of its place."""


class CubicAttachment(AtPlace):
    """An attachment whose stiffness grows with the square of the displacement amplitude."""

    @abc.abstractmethod
    def hardening(self) -> Float[Array, ""]:
        """Growth of the equivalent stiffness with the amplitude squared [N/m^3]."""


class Modulus(StructureEffect):
    """A stiffness that depends on frequency and loses energy, everywhere on the structure."""

    @abc.abstractmethod
    def relative_modulus(self, omega: Omega) -> Complex[Array, "frequency"]:
        """What is added to the modulus, over the modulus as drawn [1]."""

    def kept_damping(self) -> Float[Array, ""]:
        """Share of the damping of the structure that is still there beside it [1]."""
        return jnp.ones(())


class GlobalChange(StructureEffect):
    """An effect all along the structure proper: it changes the modes themselves."""

    @abc.abstractmethod
    def changed(self, modes: Modes) -> Modes:
        """Modes of the changed structure."""


class Hinged(StructureEffect):
    """An effect that makes the structure proper more flexible at some places."""

    @abc.abstractmethod
    def hinges(self, modes: Modes) -> Sequence[Hinge] | Sequence[Yielding]:
        """Hinges that it opens, or parts of a finite element model that give way."""


class InstrumentEffect(Effect):
    """An effect that belongs to the measurement: added by `experiment + effect`."""

    loads_structure: ClassVar[bool] = False

    def among(self: Self, channels: Sequence[Channel]) -> Self:
        """Return it with the sensors that it is about by their number.

        Raises
        ------
        ValueError
            If the experiment does not have them.
        """
        return self

    def sensors(self, sensors: Sensors, modes: Modes) -> Sensors:
        """Sensors as they truly sat."""
        return sensors

    def mounted_mass(self, sensor: str) -> Parameter:
        """Mass [kg] that a sensor brings to the structure where it sits."""
        return 0.0

    def added(self, omega: Omega) -> Float[Array, "#sensor #actuator #frequency"]:
        """Receptance [m/N] that the structure has besides that of its modes."""
        return jnp.zeros((1, 1, 1))

    def recorded(self, frf: Receptance, omega: Omega, channels: Sequence[Channel]) -> Receptance:
        """FRF as it was recorded, given the one that the structure has."""
        return frf


def is_place(leaf: Any) -> bool:
    """Tell whether a leaf is a place that a structure makes definite."""
    return is_unknown(leaf) or isinstance(leaf, Support | InSpace)


def placed(at: Place, modes: Modes, name: str) -> Position:
    """Return a place as a number, a place in space or a law, checked against the structure.

    Raises
    ------
    ValueError
        If it lies outside the structure.
    """
    return _placed.placed(at, modes.bounds(), f'Effect "{name}"', "place")


def numbered(name: Numbered, channels: Sequence[Channel]) -> Numbered:
    """Return the number of a sensor among those of an experiment.

    Effects on different sensors then differ in a number only, and are compiled once.

    Raises
    ------
    ValueError
        If there is no such sensor.
    """
    if not isinstance(name, str):
        return name
    known = sensor_names(channels)
    if name not in known:
        raise InputError(
            f'An effect on sensor "{name}" was added, but the experiment has the sensors '
            f'{", ".join(known)}. Name one of them: sensor="{known[0]}".'
        )
    return np.asarray(known.index(name))


def sensor_names(channels: Sequence[Channel]) -> list[str]:
    """Names of sensors in their order, each once."""
    return list(dict.fromkeys(one.name for one in channels))


def of_sensor(sensor: Numbered, channels: Sequence[Channel]) -> Float[Array, "sensor"]:
    """1 for the channels of one sensor, by its number; 0 for all others."""
    known = sensor_names(channels)
    numbers = np.array([known.index(one.name) for one in channels])
    return jnp.asarray(numbers == numbered(sensor, channels), float)
