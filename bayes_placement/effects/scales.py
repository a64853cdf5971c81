"""Sizes of a structure and its measurement, to which default priors are scaled."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, TypeAlias, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import LogUniform

from .._shared.compiled import compiled
from .._shared.dimensions import Receptance
from .._shared.reprs import with_short_repr
from .._shared.sites import Unknown
from ..modes.finite_elements.nodal_modes import nodal_of
from ..modes.modes import Modes, moved_mass
from ..positions.places import Position
from ..positions.vectors import CartesianComponents, triple, unit_vector
from .instruments import Instruments, TransducerProtocol

Axis: TypeAlias = CartesianComponents | None
"""A direction in space; None for the only one in which the structure moves."""

LEAST_MASS = 1e-5
"""Least share of the structure's mass. It shifts natural frequencies by about half of that, which
hundreds of lines with a noise of 1 % tell at a damping ratio of 1 %; beyond, others are claimed
for it."""

_PLACES = 33  # at which mode shapes of a line are read for its mass


@runtime_checkable
class Setup(Protocol):
    """What of an experiment its scales are taken from."""

    @property
    def structure(self) -> Any:
        """The structure, with its modes and its effects by name."""

    @property
    def sensor(self) -> Mapping[str, TransducerProtocol]:
        """Sensors by name."""

    @property
    def actuator(self) -> Mapping[str, TransducerProtocol]:
        """Actuators by name."""

    @property
    def frequency(self) -> Float[Array | np.ndarray, "frequency"]:
        """Lines [Hz]."""

    @property
    def observe(self) -> Any:
        """What is observed, with the name of its quantity."""

    @property
    def force_levels(self) -> tuple[float, ...] | None:
        """Force amplitudes [N]; None where they are not known."""

    @property
    def sensors_mounted(self) -> str:
        """`roving`, each sensor in a run of its own, or `fixed`."""

    @property
    def unknowns(self) -> Sequence[Unknown]:
        """What is unknown of it, with priors."""

    def nominal(self) -> Any:
        """The same with a typical number in the place of each unknown."""


@with_short_repr
@dataclass(frozen=True)
class Scales:
    """Sizes of a structure and its measurement, all of the nominal structure.

    Parameters
    ----------
    setup
        The experiment.

    Examples
    --------
    >>> scales = bp.effects.Scales(experiment)
    >>> round(float(scales.mass), 2), scales.band
    (9.0, (100.0, 650.0))
    """

    setup: Setup

    @property
    def modes(self) -> Modes:
        """Modes of the structure, some of whose numbers may be distributions."""
        return self.setup.structure.modes

    @cached_property
    def nominal_modes(self) -> Modes:
        """Modes of the structure at typical values of what is unknown."""
        return self.setup.nominal().structure.modes

    @property
    def instruments(self) -> Instruments:
        """Sensors and actuators."""
        return Instruments(self.setup.sensor, self.setup.actuator)

    @property
    def nominal_effects(self) -> Sequence[object]:
        """Effects that the structure has, at typical values of what is unknown."""
        return [*self.setup.nominal().structure.effects.values()]

    def unknown_numbers(self) -> Sequence[Unknown]:
        """Unknown numbers of the structure; vectors and places of its effects are left out."""
        return [
            unknown
            for unknown in self.setup.unknowns
            if unknown.name.startswith("structure.") and unknown.distribution.shape() == ()
            if unknown.owner.kind != "effects"
            or unknown.field not in self.setup.structure.effects[unknown.owner.name].place_fields
        ]

    @property
    def sensors_roved(self) -> bool:
        """Whether each sensor is mounted in a run of its own."""
        return self.setup.sensors_mounted == "roving"

    @property
    def exciters_may_be_mounted(self) -> bool:
        """Whether actuators may be exciters that stay mounted: no more of them than sensors.

        Where there are more they are taken for the hits of a roved hammer, which hold nothing.
        """
        return len(self.setup.actuator) <= len(self.setup.sensor)

    @property
    def modes_alone(self) -> bool:
        """Whether modal parameters are observed, as where nothing is known to drive it."""
        return not self.setup.actuator

    @property
    def modes_observed(self) -> int:
        """Number of the lowest elastic modes among which are all that modal parameters are of."""
        observe = self.setup.observe
        return max(observe.number or (observe.values.shape[1],)) if observe.is_modal else 1

    @property
    def phase_observed(self) -> bool:
        """Whether FRFs are observed with their phase, in two parts."""
        return bool(self.setup.observe.parts == 2)

    @property
    def quantity(self) -> str:
        """Motion that is observed: displacement, velocity or acceleration."""
        return str(self.setup.observe.quantity)

    def places(self) -> list[Position]:
        """Uniform priors of a place [m], one for each piece of the structure."""
        return self.modes.anywhere()

    def places_and_directions(self) -> list[tuple[Position, Axis]]:
        """Every piece of the structure, with each axis along which it moves."""
        axes = self.modes.axes
        directions = [None] if len(axes) == 1 else [triple(unit_vector(axis)) for axis in axes]
        return list(itertools.product(self.places(), directions))

    def extents(self, *, lines_alone: bool = False) -> list[tuple[Position, Any]]:
        """Priors of the middle and of the extent [m] of a part of a line, or of a plate.

        A part of a frame is none: a box about it would hold several members.
        """
        low, high = (np.atleast_1d(end) for end in self.nominal_modes.bounds())
        sizes = [float(size) for size in high - low]
        edges = tuple(LogUniform(0.02 * size, size) if size else None for size in sizes)
        places = self.places()
        if len(sizes) == 1:
            return [(place, edges[0]) for place in places]
        is_plate = sizes.count(0.0) == 1 and len(places) == 1
        return [(places[0], edges)] if is_plate and not lines_alone else []

    @cached_property
    def band(self) -> tuple[float, float]:
        """Least and greatest line above 0 Hz [Hz]."""
        lines = np.asarray(self.setup.frequency)
        return float(np.min(lines[lines > 0])), float(np.max(lines))

    @property
    def middle(self) -> float:
        """Geometric middle of the band [Hz]."""
        return math.sqrt(math.prod(self.band))

    @property
    def angular_frequency(self) -> float:
        """Geometric middle of the band [rad/s]."""
        return 2 * math.pi * self.middle

    @cached_property
    def mass(self) -> float:
        """Mass that the modes move [kg]: the mass of the structure, where it is uniform."""
        nodal = nodal_of(self.nominal_modes)
        if nodal is not None:
            return nodal.mass
        low, high = self.nominal_modes.bounds()
        # Free ends move most: places in the middle of equal parts count them as they should be.
        places = np.linspace(low, high, 2 * _PLACES + 1)[1::2]
        return moved_mass(compiled(_squared_shapes)(self.nominal_modes, places))

    @property
    def least_mass(self) -> float:
        """Least mass [kg] of default priors, so small that a lesser one does not show."""
        return LEAST_MASS * self.mass

    @property
    def stiffness(self) -> float:
        """Stiffness [N/m] whose force is that of the mass in the middle of the band."""
        return self.mass * self.angular_frequency**2

    @property
    def any_stiffness(self) -> LogUniform:
        """Prior of a stiffness [N/m] of 1e-5 to 100 times that of the mass."""
        return LogUniform(1e-5 * self.stiffness, 1e2 * self.stiffness)

    @cached_property
    def displacement(self) -> float | None:
        """Greatest displacement [m], at resonance under the greatest force; None if not known."""
        if self.setup.force_levels is None:
            return None
        response = np.asarray(compiled(_receptance)(self.setup.nominal()))
        return float(np.nanmax(np.abs(response)) * max(self.setup.force_levels))


def _squared_shapes(
    modes: Modes, places: Float[Array, "place *coordinate"]
) -> Float[Array, "place mode"]:
    return jax.vmap(lambda place: jnp.sum(modes.shapes(place) ** 2, axis=0))(places)


def _receptance(nominal: Any) -> Receptance:
    return nominal.receptance()
