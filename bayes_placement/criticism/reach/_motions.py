"""Motions of a structure under unit forces at its instruments, which any place reads.

The receptance from an instrument to a place is the product of both, so that instruments and places
are computed apart: a place costs products over modes, whatever is attached elsewhere.
"""

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Complex, Float

from ..._shared.compiled import compiled
from ..._shared.sites import substitute
from ...experiment.frf import motion, readings, receptance
from ...inference.residuals import Problem
from ...modes.points import joined

PLACES, FEW_PLACES = 256, 16
"""Places that are read by one call, padded: of many, and of few."""

AT_ONCE = 8
"""Places that are read together: distances to all nodes of a large mesh have to stay at hand."""

Shapes = Float[np.ndarray, "place coordinate"]
"""Readings of motions at places."""


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

    def at_lines(self, lines: Any) -> Complex[np.ndarray, "coordinate instrument line"]:
        """Motions at some lines, those of sensors first."""
        return np.asarray(self._compiled(self.omega[lines]))

    @functools.cached_property
    def _compiled(self) -> Any:
        return compiled(motion).bound(self.structure, self._driven)

    @functools.cached_property
    def at_sensors(self) -> Shapes:
        """Readings at the sensors."""
        driven, omega = self._driven, self.omega[:1]
        return np.asarray(compiled(readings)(self.structure, driven, driven, omega))[: self.sensors]

    def readings(
        self, effects: Sequence[Any], values: Mapping[str, Any]
    ) -> Float[np.ndarray, "port place coordinate"]:
        """Readings of the ports of effects, at values of their common place."""
        read = self._at_values(_readings, effects, values, self.omega[:1])
        return np.ascontiguousarray(np.moveaxis(read, 1, 0))

    def receptances(
        self, effect: Any, values: Mapping[str, Any]
    ) -> Complex[np.ndarray, "place frequency"]:
        """Receptance of the port of an effect, at values of its place."""
        return self._at_values(_receptances, [effect], values, self.omega)

    def _at_values(
        self, function: Any, effects: Sequence[Any], values: Mapping[str, Any], omega: Any
    ) -> np.ndarray:
        """What a function of ports returns at each value of their place."""
        numbers = np.stack([np.asarray(value, float) for value in values.values()], axis=-1)
        of_places = compiled(function).bound(
            self.structure, tuple(effects), self._driven, omega, tuple(values)
        )
        size = PLACES if len(numbers) > FEW_PLACES else FEW_PLACES
        rows = [
            np.minimum(np.arange(start, start + size), len(numbers) - 1)
            for start in range(0, len(numbers), size)
        ]
        return np.concatenate([np.asarray(of_places(numbers[row])) for row in rows])[: len(numbers)]


def form(shapes: Shapes, table: Any) -> Any:
    """Products of shapes with a contiguous table [..., coordinate, line] of complex numbers."""
    return (shapes @ table.view(shapes.dtype)).view(table.dtype)


def _readings(
    structure: Any, effects: Any, driven: Any, omega: Any, names: tuple[str, ...], numbers: Any
) -> Any:
    """Readings of ports at a batch of places."""

    def at(numbers: Any) -> Any:
        ports = _ports_at(structure, effects, names, numbers)
        return jnp.concatenate([readings(structure, port, driven, omega) for port in ports])

    return jax.lax.map(at, numbers, batch_size=AT_ONCE)


def _receptances(
    structure: Any, effects: Any, driven: Any, omega: Any, names: tuple[str, ...], numbers: Any
) -> Any:
    """Receptance of a port at a batch of places."""

    def at(numbers: Any) -> Any:
        (port,) = _ports_at(structure, effects, names, numbers)
        return receptance(structure, port, port, omega)[0, 0]

    return jax.lax.map(at, numbers, batch_size=AT_ONCE)


def _ports_at(structure: Any, effects: Any, names: tuple[str, ...], numbers: Any) -> list[Any]:
    """Ports of effects, each with the same values of its place."""
    values = dict(zip(names, numbers, strict=True))
    placed = [substitute(effect, values) for effect in effects]
    laws = [each.port_laws(structure.modes, jnp.ones(1), jnp.ones(1)) for each in placed]
    return [law.points for (law,) in laws]
