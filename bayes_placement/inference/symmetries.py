"""Placements that may explain the same data as another one: its mirror image, an exchange.

A sampler may try them as moves; each keeps volume and is its own inverse, and is accepted or not by
the posterior, so a wrong guess costs time, never correctness.
"""

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._shared.compiled import compiled
from .._shared.dimensions import Parameter
from .._shared.sites import Role, Unknown
from ..experiment.experiment import Experiment
from ..modes.modes import Modes

Values = dict[str, Any]
"""Values of unknowns, by name."""

Move = Callable[[Values], Values]

SAMPLES = 16
"""Points along a line at which shapes are compared with their mirror images."""


def symmetries(experiment: Experiment) -> tuple[Move, ...]:
    """Moves between placements: the mirror image, and sensor and actuator exchanged."""
    positions = [
        unknown.name
        for unknown in experiment.unknowns
        if unknown.is_placement and _is_on_a_line(unknown)
    ]
    moves: list[Move] = []
    if positions:
        moves.append(_mirror(experiment, positions))
    if len(positions) == 2 and len(experiment.sensor) == len(experiment.actuator) == 1:
        moves.append(_exchange(experiment, *positions))
    return tuple(moves)


def _is_on_a_line(unknown: Unknown) -> bool:
    is_scalar = not unknown.component and unknown.distribution.shape() == ()
    return unknown.field == "position" and is_scalar


def _errors(experiment: Experiment, *kinds: str) -> list[Unknown]:
    """Errors of the model of some kinds, without their sizes."""
    return [
        unknown
        for unknown in experiment.unknowns
        if unknown.role is Role.MODEL_ERROR
        and unknown.owner.kind in kinds
        and unknown.field != "size"
    ]


class _Mirror(eqx.Module):
    """Mirror image of positions on a line, and of what errs there.

    The mirror image of an odd shape has the other sign, and so have the errors that are added to
    it. Pieces are counted from the other end.
    """

    positions: tuple[str, ...] = eqx.field(static=True)
    shape_errors: tuple[str, ...] = eqx.field(static=True)
    piece_errors: tuple[str, ...] = eqx.field(static=True)
    low: float
    high: float
    parity: Float[Array | np.ndarray, "mode"]

    def __call__(self, values: Values) -> Values:
        """Values with all positions mirrored."""
        return (
            values
            | {name: self.low + self.high - values[name] for name in self.positions}
            | {name: self.parity * values[name] for name in self.shape_errors}
            | {name: values[name][::-1] for name in self.piece_errors}
        )


def _mirror(experiment: Experiment, positions: Sequence[str]) -> _Mirror:
    errors = experiment.model_error
    low, high = _ends(experiment.structure.modes)
    shape_errors = [unknown.name for unknown in _errors(experiment, "shape", "ports")]
    parity = np.ones(0)
    if shape_errors and errors is not None:
        parity = np.asarray(compiled(_parity)(experiment.nominal().structure.proper_modes()))
        parity = parity[errors.rigid_body_modes :][: errors.modes]
    return _Mirror(
        tuple(positions),
        tuple(shape_errors),
        tuple(unknown.name for unknown in _errors(experiment, "stiffness_and_mass")),
        low,
        high,
        parity,
    )


def _ends(modes: Modes) -> tuple[Parameter, Parameter]:
    """Ends of a line [m]."""
    low, high = modes.bounds()
    return low, high


def _parity(modes: Modes) -> Float[Array, "mode"]:
    """1 for each mode that is even about the middle of a line, -1 for an odd one."""
    low, high = _ends(modes)
    place = low + (high - low) * (jnp.arange(SAMPLES) + 0.5) / SAMPLES
    shapes = jax.vmap(modes.shapes)(place)  # (place, axis, mode)
    return jnp.where(jnp.einsum("pam,pam->m", shapes, shapes[::-1]) < 0, -1.0, 1.0)


class _Exchange(eqx.Module):
    """Values of two unknowns exchanged, for each pair of them."""

    pairs: tuple[tuple[str, str], ...] = eqx.field(static=True)

    def __call__(self, values: Values) -> Values:
        """Values with either of a pair in the other's place."""
        exchanged = {first: values[second] for first, second in self.pairs}
        return values | exchanged | {second: values[first] for first, second in self.pairs}


def _exchange(experiment: Experiment, sensor: str, actuator: str) -> _Exchange:
    """Positions of sensor and actuator exchanged, with the errors of their channels."""
    pairs: list[tuple[str, str]] = [(sensor, actuator)]
    for kind in ("shape", "gain"):
        errors = _errors(experiment, kind)
        if len(errors) == 2 and errors[0].distribution.shape() == errors[1].distribution.shape():
            pairs.append((errors[0].name, errors[1].name))
    return _Exchange(tuple(pairs))
