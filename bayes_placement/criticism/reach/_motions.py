"""Motions of a structure under unit forces at its instruments, which any place reads.

The receptance from an instrument to a place is the product of both, so that instruments and places
are computed apart: a place costs products over modes, whatever is attached elsewhere.
"""

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..._shared.compiled import Bound, compiled
from ..._shared.dimensions import Spectrum
from ..._shared.sites import substitute
from ...effects.effect import Omega, OnPorts
from ...experiment.frf import motion, readings, receptance
from ...experiment.structure import Structure
from ...inference.residuals import Problem
from ...modes.points import Points, joined
from ._slopes import SomeLines

PLACES, FEW_PLACES = 256, 16
"""Places that are read by one call, padded: of many, and of few."""

AT_ONCE = 8
"""Places that are read together: distances to all nodes of a large mesh have to stay at hand."""

Shapes = Float[np.ndarray, "place coordinate"]
"""Readings of motions at places."""

Numbers = Float[Array, "place component"]
Values: TypeAlias = Mapping[str, Float[np.ndarray, "place"]]
"""Values of the unknowns of a place, by their names in an effect, at each of some places."""


class Motions:
    """Motions under forces at the instruments, all unknowns known."""

    def __init__(self, problem: Problem, point: Float[np.ndarray, "unknown"]):
        values = problem.coordinates.named(point[None])
        known = problem.at_fixed_sizes.fix({name: value[0] for name, value in values.items()})
        sides = [
            known.instruments.points(side, known.structure.modes.axes)
            for side in ("sensor", "actuator")
        ]
        self.structure, self.sensors, self._driven = known.structure, sides[0].count, joined(sides)
        self.omega = 2 * np.pi * np.asarray(known.frequency, float)

    def at_lines(self, lines: SomeLines) -> Complex[np.ndarray, "coordinate instrument line"]:
        """Motions at some lines, those of sensors first."""
        return np.asarray(self._compiled(self.omega[lines]))

    @functools.cached_property
    def _compiled(self) -> Bound[Complex[Array, "coordinate instrument line"]]:
        return compiled(motion).bound(self.structure, self._driven)

    @functools.cached_property
    def at_sensors(self) -> Shapes:
        """Readings at the sensors."""
        driven, omega = self._driven, self.omega[:1]
        return np.asarray(compiled(readings)(self.structure, driven, driven, omega))[: self.sensors]

    def readings(
        self, effects: Sequence[OnPorts], values: Values
    ) -> Float[np.ndarray, "port place coordinate"]:
        """Readings of the ports of effects, at values of their common place."""
        read = self._at_values(_readings, values, self.omega[:1], *effects)
        return np.ascontiguousarray(np.moveaxis(read, 1, 0))

    def receptances(self, on: OnPorts, values: Values) -> Complex[np.ndarray, "place frequency"]:
        """Receptance of the port of an effect, at values of its place."""
        return self._at_values(_receptances, values, self.omega, on)

    def _at_values(
        self, function: Callable[..., Array], values: Values, omega: Spectrum, *effects: OnPorts
    ) -> np.ndarray:
        """What a function of ports returns at each value of their place."""
        numbers = np.stack([np.asarray(value, float) for value in values.values()], axis=-1)
        placed = _PlacedEffects(self.structure, effects, tuple(values))
        of_places = compiled(function).bound(placed, self._driven, omega)
        size = PLACES if len(numbers) > FEW_PLACES else FEW_PLACES
        rows = [
            np.minimum(np.arange(start, start + size), len(numbers) - 1)
            for start in range(0, len(numbers), size)
        ]
        return np.concatenate([np.asarray(of_places(numbers[row])) for row in rows])[: len(numbers)]


def form(shapes: Shapes, table: Complex[np.ndarray, "*row coordinate line"]) -> np.ndarray:
    """Products of shapes with a contiguous table [..., coordinate, line] of complex numbers."""
    return (shapes @ table.view(shapes.dtype)).view(table.dtype)


class _PlacedEffects(NamedTuple):
    """Effects on a structure, and the names of the unknowns of their common place."""

    structure: Structure
    effects: tuple[OnPorts, ...]
    names: tuple[str, ...]

    def ports(self, numbers: Float[Array, "component"]) -> list[Points]:
        """Ports of the effects, each with the same values of its place."""
        values = dict(zip(self.names, numbers, strict=True))
        placed = [substitute(effect, values) for effect in self.effects]
        laws = [each.port_laws(self.structure.modes, jnp.ones(1), jnp.ones(1)) for each in placed]
        return [law.points for (law,) in laws]


def _readings(
    placed: _PlacedEffects, driven: Points, omega: Omega, numbers: Numbers
) -> Float[Array, "place port coordinate"]:
    """Readings of ports at a batch of places."""

    def at(numbers: Float[Array, "component"]) -> Float[Array, "port coordinate"]:
        read = [readings(placed.structure, port, driven, omega) for port in placed.ports(numbers)]
        return jnp.concatenate(read)

    return jax.lax.map(at, numbers, batch_size=AT_ONCE)


def _receptances(
    placed: _PlacedEffects, driven: Points, omega: Omega, numbers: Numbers
) -> Complex[Array, "place frequency"]:
    """Receptance of a port at a batch of places."""

    def at(numbers: Float[Array, "component"]) -> Complex[Array, "frequency"]:
        (port,) = placed.ports(numbers)
        return receptance(placed.structure, port, port, omega)[0, 0]

    return jax.lax.map(at, numbers, batch_size=AT_ONCE)
