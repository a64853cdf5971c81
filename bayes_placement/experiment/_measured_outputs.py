"""Measured FRFs as outputs z, with the standard deviations that coherence and averages give."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from .._compiled import compiled
from .._types import Response
from .noise import Data
from .observation import Observation


def measured_outputs(
    observe: Observation, frf: Any, variance: Any = None, *, amplitude: bool = False
) -> Data:
    """Turn measured FRFs into outputs.

    Parameters
    ----------
    observe
        The mapping z = f(U).
    frf
        FRFs of the observed quantity, of shape (sensor, actuator, frequency); NaN where nothing
        was measured.
    variance
        E|error|^2 of each FRF value [unit of the FRF squared], NaN where nothing was measured;
        None where the level of the output error comes from elsewhere.
    amplitude
        Whether the level of the output error depends on the amplitude of the FRFs.
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
