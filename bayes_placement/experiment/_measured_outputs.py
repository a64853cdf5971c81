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
    z = compiled(_output)(observe, filled)
    if observe.parts > 1:
        measured = np.broadcast_to(measured[..., None, :], z.shape)
    # A level where nothing was measured is never used, but it must not be NaN in a gradient.
    level = None if variance is None else jnp.where(jnp.isnan(variance), 1.0, variance)
    deviation = None if level is None else compiled(_deviation)(observe, filled, level)
    levels = compiled(_unit_deviations)(observe, filled) if amplitude else (None, None)
    return Data(jnp.where(measured, z, 0.0), measured, deviation, *levels)


def simulated_outputs(observe: Observation, frf: Any) -> Data:
    """Turn predicted FRFs into the data of a measurement without error, all of it measured."""
    z = observe.output(frf)
    return Data(z, np.ones(z.shape, dtype=bool), None, *_unit_deviations(observe, frf))


def _output(observe: Observation, frf: Any) -> Response:
    return observe.output(frf)


def _unit_deviations(observe: Observation, frf: Any) -> tuple[Response, Response]:
    """Deviations of the outputs for E|error|^2 = |H|^2 and for E|error|^2 = 1."""
    square = jnp.abs(frf) ** 2
    return observe.deviation(frf, square), observe.deviation(frf, jnp.ones_like(square))


def _deviation(observe: Observation, frf: Any, variance: Any) -> Response:
    return observe.deviation(frf, variance)
