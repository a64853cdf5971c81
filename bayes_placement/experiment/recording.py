"""recording: in, a structure, its instruments and their faults; out, the recorded receptance.

Not known here: probability, decibels, what is compared with what.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Inexact

from .._types import Receptance
from ..effects._effect import InstrumentEffect
from ..modes.modes import Modes
from ..modes.points import Points, along_axes, joined
from ..positions.places import coordinates
from .frf import Held, receptance
from .structure import Structure
from .transducers import Actuator, Sensor

MOUNTINGS = ("roving", "fixed")
"""Each sensor in a run of its own, or all of them mounted all the time."""


class Drive(NamedTuple):
    """Lines at which a structure is driven [rad/s], how hard [N], and how sensors are mounted."""

    omega: Inexact[Array, "frequency"]
    force: Float[Array, "frequency"] | None
    mounting: str


def recorded(
    structure: Structure,
    sensors: Mapping[str, Sensor],
    actuators: Mapping[str, Actuator],
    chain: Sequence[InstrumentEffect],
    drive: Drive,
) -> Receptance:
    """Receptance [m/N] as the instruments recorded it.

    The structure moves with the sensors where and as heavy as they are; then their signals are
    delayed, amplified or exchanged.
    """
    for effect in chain:
        sensors = effect.sensors(sensors, structure.modes)
    response = _loaded(structure, sensors, actuators, chain, drive)
    named = [channel for one in sensors.values() for channel in one.channels]
    for effect in chain:
        response = response + effect.added(drive.omega)
    for effect in chain:
        response = effect.recorded(response, drive.omega, named)
    return response


def _loaded(
    structure: Structure,
    sensors: Mapping[str, Sensor],
    actuators: Mapping[str, Actuator],
    chain: Sequence[InstrumentEffect],
    drive: Drive,
) -> Receptance:
    """Receptance with what the sensors bring to the structure."""
    axes = structure.modes.axes
    read = joined([one.points(axes) for one in sensors.values()])
    driven = joined([one.points(axes) for one in actuators.values()])
    weighing = [one for one in chain if one.loads_structure]

    def between(read: Points, held: Sequence[Held]) -> Receptance:
        return receptance(structure, read, driven, drive.omega, held=held, force=drive.force)

    if not weighing:
        return between(read, [])
    masses = {name: _mass(name, weighing) for name in sensors}
    if drive.mounting == "fixed":
        held = [
            _held(coordinates(one.position), masses[name], structure.modes, drive)
            for name, one in sensors.items()
        ]
        return between(read, held)

    def change(one: Points, mass: Float[Array, ""]) -> Receptance:
        held = [_held(one.position[0], mass, structure.modes, drive)]
        return between(one, held) - between(one, [])

    # Each channel as if in a run of its own: those of one sensor see the same mass. Only what the
    # mass changes, so that without it nothing changes, bit for bit.
    each = jax.tree.map(lambda leaf: jnp.asarray(leaf)[:, None], read)
    mass = jnp.stack([masses[name] for name, one in sensors.items() for _ in one.channels])
    return between(read, []) + jax.vmap(change)(each, mass)[:, 0]


def _mass(sensor: str, weighing: Sequence[InstrumentEffect]) -> Float[Array, ""]:
    """Mass [kg] that a sensor brings."""
    return sum((jnp.asarray(one.mounted_mass(sensor), float) for one in weighing), jnp.zeros(()))


def _held(
    position: Float[Array, "*coordinate"], mass: Float[Array, ""], modes: Modes, drive: Drive
) -> Held:
    """Hold the structure, as the mass of a sensor does: in every axis of its motion."""
    return Held(along_axes(position, modes), -(drive.omega**2) * mass)
