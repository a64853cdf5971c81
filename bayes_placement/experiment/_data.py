"""Measured outputs with what is known of their errors."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool

from .._shared.dimensions import Response


class Data(eqx.Module):
    """Measured outputs, in the shape of the predicted ones."""

    z: Response
    """Measured outputs; zero where nothing was measured."""
    measured: Bool[Array | np.ndarray, "sensor actuator *level_and_part frequency"]
    """Where something was measured."""
    deviation: Response | None = None
    """Standard deviation of each output known from the measurement, or None."""
    relative: Response | None = None
    absolute: Response | None = None
    """Standard deviation of each output for E|error|^2 = |H|^2, |H| being the measured amplitude,
    and for E|error|^2 = 1; None where the noise does not need them."""

    def of(self, sensors: Any = slice(None), actuators: Any = slice(None)) -> "Data":
        """Return the data of some sensor and actuator channels."""

        def pick(values: Any) -> Any:
            if values is None:
                return None
            # By NumPy where they are known: to pick by numbers would be compiled.
            known = values if isinstance(values, jax.core.Tracer) else np.asarray(values)
            return jnp.asarray(known[sensors][:, actuators])

        return Data(*(pick(getattr(self, name)) for name in _FIELDS))

    @staticmethod
    def at_levels(runs: "Sequence[Data]") -> "Data":
        """Return the data of several force levels, one run each, as one."""

        def stacked(values: list[Any]) -> Any:
            xp = np if isinstance(values[0], np.ndarray) else jnp
            return None if values[0] is None else xp.stack(values, axis=2)

        return Data(*(stacked([getattr(run, name) for run in runs]) for name in _FIELDS))


_FIELDS = ("z", "measured", "deviation", "relative", "absolute")
