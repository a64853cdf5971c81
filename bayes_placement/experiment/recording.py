"""The receptance of a structure as its instruments recorded it."""

import dataclasses
from collections.abc import Iterable, Sequence
from functools import partial
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Inexact

from .._shared.dimensions import Receptance
from ..effects.effect import Omega
from ..effects.instrument_effect import InstrumentEffect
from ..effects.instruments import Instruments
from ..modes.points import Points, along_axes
from ..modes.ports import PortLaw, singly
from ..positions.places import coordinates
from .frf import receptance
from .model_error import SIDES, ModalErrors
from .structure import Structure

MOUNTINGS = ("roving", "fixed")
"""Each sensor alone in its run, or all of them mounted all the time."""

DynamicStiffness: TypeAlias = Inexact[Array, "frequency"]

Factor: TypeAlias = Float[Array, "erroneous"]
"""Factor on the natural frequencies of the first modes in a run [1]."""


class Drive(NamedTuple):
    """How a structure is driven and its sensors are mounted."""

    omega: Inexact[Array, "frequency"]
    """Angular frequencies [rad/s]."""
    force: Float[Array, "frequency"] | None
    """Amplitude [N] of the force at each; None where it is not known."""
    mounting: str
    """One of `MOUNTINGS`."""


def recorded(
    structure: Structure,
    instruments: Instruments,
    instrument_effects: Sequence[InstrumentEffect],
    drive: Drive,
    model_error: ModalErrors | None = None,
) -> Receptance:
    """Receptance [m/N] as the instruments recorded it.

    Effects first move the instruments, then load the structure at their positions, then change
    the signals: delay, amplify or exchange them.
    """
    for effect in instrument_effects:
        instruments = effect.moved(instruments, structure.modes)
    drive = drive._replace(omega=recorded_frequency(instrument_effects, drive.omega))

    def respond(omega: Omega) -> Receptance:
        at = drive._replace(omega=omega)
        return _Loaded(structure, instruments, instrument_effects, at, model_error).response()

    for effect in instrument_effects:
        respond = partial(effect.evaluated, respond, instruments=instruments)
    response = respond(drive.omega)
    if model_error is not None:
        sensor, actuator = (model_error.gain_factors(instruments, side) for side in SIDES)
        response = response * (sensor[:, None] * actuator)[..., None]
    for effect in instrument_effects:
        response = response + effect.added(drive.omega)
    response = amplified(response, instruments, drive.omega)
    for effect in instrument_effects:
        response = effect.recorded(response, drive.omega, instruments)
    return response


def recorded_frequency(instrument_effects: Iterable[InstrumentEffect], omega: Omega) -> Omega:
    """Variable s / i at which the record is evaluated, omega [rad/s] but for a window or rate.

    By name, so that the order of adding is of no consequence.
    """
    for effect in sorted(instrument_effects, key=lambda effect: effect.name):
        omega = effect.laplace(omega)
    return omega


def amplified(response: Receptance, instruments: Instruments, omega: Omega) -> Receptance:
    """Receptance with the gain and the delay of each channel, untouched where all are exact."""
    for axis, side in enumerate((instruments.sensors, instruments.actuators)):
        factors = [
            transducer.factor(omega) for transducer in side.values() for _ in transducer.channels
        ]
        if any(factor is not None for factor in factors):
            exact = jnp.ones(omega.shape)
            rows = jnp.stack([exact if factor is None else factor for factor in factors])
            response = response * jnp.expand_dims(rows, 1 - axis)
    return response


class _Loaded(NamedTuple):
    """A structure loaded by its instruments at their positions."""

    structure: Structure
    instruments: Instruments
    instrument_effects: Sequence[InstrumentEffect]
    drive: Drive
    model_error: ModalErrors | None
    run_factor: Factor | None = None

    def response(self) -> Receptance:
        """Receptance between all channels; an actuator is mounted only in its runs."""
        driven = self._points("actuator")
        loads = self._stiffness("actuator") if self._loading("actuator") else None
        factors = (
            None if self.model_error is None else self.model_error.run_factors(self.instruments)
        )
        if factors is None:
            return self._driven(driven, loads)

        def run(actuator: Points, load: DynamicStiffness | None, factor: Factor) -> Receptance:
            single_load = None if load is None else load[None]
            return self._replace(run_factor=factor)._driven(actuator, single_load)

        axes = 0, None if loads is None else 0, 0
        runs = jax.vmap(run, in_axes=axes, out_axes=1)(singly(driven), loads, factors)
        return runs[:, :, 0]

    def _driven(
        self, driven: Points, loads: Inexact[Array, "channel frequency"] | None
    ) -> Receptance:
        """Receptance to some actuator channels, each loaded in its run."""
        if loads is None:
            return self._with_sensors(driven, [])

        def change(actuator: Points, stiffness: DynamicStiffness) -> Receptance:
            port = self._port(actuator.position[0], stiffness)
            return self._with_sensors(actuator, [port]) - self._with_sensors(actuator, [])

        changes = jax.vmap(change, out_axes=1)(singly(driven), loads)
        return self._with_sensors(driven, []) + changes[:, :, 0]

    def _with_sensors(self, driven: Points, ports: Sequence[PortLaw]) -> Receptance:
        """Receptance with the sensors, all mounted or each alone in its runs."""
        read = self._points("sensor")
        if not self._loading("sensor"):
            return self._between(read, driven, ports)
        if self.drive.mounting == "fixed":
            return self._between(read, driven, [*self._ports("sensor"), *ports])

        def change(sensor: Points, stiffness: DynamicStiffness) -> Receptance:
            port = self._port(sensor.position[0], stiffness)
            loaded = self._between(sensor, driven, [port, *ports])
            return loaded - self._between(sensor, driven, ports)

        # Channels of one sensor have the same load. Only the change by the load is added, so that
        # without it the receptance stays the same, bit for bit.
        changes = jax.vmap(change)(singly(read), self._stiffness("sensor"))
        return self._between(read, driven, ports) + changes[:, 0]

    def _between(self, read: Points, driven: Points, ports: Sequence[PortLaw]) -> Receptance:
        omega, force, _ = self.drive
        mode_error = None if self.model_error is None else self.model_error.mode_error()
        if mode_error is not None and self.run_factor is not None:
            mode_error = mode_error._replace(frequency=mode_error.frequency * self.run_factor)
        return receptance(
            self.structure, read, driven, omega, ports=ports, force=force, mode_error=mode_error
        )

    def _points(self, side: str) -> Points:
        axes = self.structure.modes.axes
        points = self.instruments.points(side, axes)
        if self.model_error is None:
            return points
        error = self.model_error.shape_error(self.instruments, side)
        return dataclasses.replace(points, shape_error=error)

    def _loading(self, side: str) -> list[InstrumentEffect]:
        """Effects that load the structure at the positions of the transducers of a side."""
        return [effect for effect in self.instrument_effects if side in effect.loads]

    def _ports(self, side: str) -> list[PortLaw]:
        """Port of each transducer of a side, with its dynamic stiffness."""
        return [
            self._port(coordinates(transducer.position), self._load(side, number))
            for number, transducer in enumerate(self.instruments.side(side).values())
        ]

    def _port(self, position: Float[Array, "*coordinate"], stiffness: DynamicStiffness) -> PortLaw:
        """A dynamic stiffness in every axis in which the structure moves."""
        return PortLaw(along_axes(position, self.structure.modes), stiffness)

    def _load(self, side: str, number: int) -> DynamicStiffness:
        """Dynamic stiffness of one transducer [N/m]."""
        omega = self.drive.omega
        loads = [effect.load(side, number, omega) for effect in self._loading(side)]
        return sum(loads[1:], loads[0])

    def _stiffness(self, side: str) -> Inexact[Array, "channel frequency"]:
        """Dynamic stiffness of the transducer of each channel [N/m]."""
        loads = [
            self._load(side, number)
            for number, transducer in enumerate(self.instruments.side(side).values())
            for _ in transducer.channels
        ]
        return jnp.stack(loads)
