"""Measured FRFs as outputs z, with the standard deviations that coherence and averages give."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from .._shared.compiled import compiled
from .._shared.dimensions import Response
from .noise import Data
from .observation import Observation


def measured_outputs(
    observe: Observation, frf: Any, variance: Any = None, *, amplitude: bool = False
) -> Data:
    """Turn measured FRFs into outputs.

    FRFs [sensor, actuator, frequency] and their variances E|error|^2 are NaN where nothing was
    measured; there are none where the level of the output error comes from elsewhere, which may
    depend on the amplitude.
    """
    measured = np.isfinite(frf)
    filled = np.where(measured, frf, 1.0)
    z, *deviations = compiled(_outputs)(observe, filled, measured, variance, amplitude)
    if observe.parts > 1:
        measured = np.broadcast_to(measured[..., None, :], z.shape)
    return Data(z, measured, *deviations)


def simulated_outputs(observe: Observation, frf: Any) -> Data:
    """Turn predicted FRFs into the data of a measurement without error, all of it measured."""
    z = observe.output(frf)
    return Data(z, np.ones(z.shape, dtype=bool), None, *_unit_deviations(observe, frf))


def _outputs(
    observe: Observation, frf: Any, measured: Any, variance: Any, amplitude: bool
) -> tuple[Response, Response | None, Response | None, Response | None]:
    """Outputs, zero where not measured, and their deviations; None where these are not known."""
    z = observe.output(frf)
    of_parts = measured[..., None, :] if observe.parts > 1 else measured
    deviation = None
    if variance is not None:
        # A level where nothing was measured is never used, but it must not be NaN in a gradient.
        deviation = observe.deviation(frf, jnp.where(jnp.isnan(variance), 1.0, variance))
    unit, constant = _unit_deviations(observe, frf) if amplitude else (None, None)
    return jnp.where(of_parts, z, 0.0), deviation, unit, constant


def _unit_deviations(observe: Observation, frf: Any) -> tuple[Response, Response]:
    """Deviations of the outputs for E|error|^2 = |H|^2 and for E|error|^2 = 1."""
    square = jnp.abs(frf) ** 2
    return observe.deviation(frf, square), observe.deviation(frf, jnp.ones_like(square))
