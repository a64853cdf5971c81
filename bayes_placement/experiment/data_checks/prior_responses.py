"""What the model can answer before any data: FRFs at draws from the priors."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import equinox as eqx
import numpy as np
from jaxtyping import Complex, Float

from ..._shared.compiled import compiled
from ..._shared.dimensions import Receptance
from ..prior_draws import draws_from_priors
from ..quantities import quantity_of

if TYPE_CHECKING:
    from ..experiment import Experiment
from .record import Record

DRAWS = 20
"""Draws from the priors: the greatest of a statistic over them is exceeded in 1 of 21 cases."""

Response = Complex[np.ndarray, "sensor actuator frequency"]


def prior_responses(
    record: Record, frequency: Float[np.ndarray, "frequency"]
) -> tuple[Response, Sequence[Response]]:
    """FRFs of the measured quantity [m/N, (m/s)/N or (m/s²)/N] of the nominal model, and at draws.

    Lines are above 0 Hz.
    """
    derivative = quantity_of(record.measurement.quantity).derivative
    power = (2j * np.pi * frequency) ** derivative

    def response(values: dict[str, Any]) -> Response:
        at_lines = eqx.tree_at(
            lambda tree: tree.frequency, record.experiment.fix(values), frequency
        )
        receptance = np.asarray(compiled(_receptance)(at_lines))
        flat = receptance if receptance.ndim == 3 else receptance[:, :, record.level]
        return np.asarray(flat * power)

    nominal = response(record.experiment.nominal_values())
    return nominal, [response(values) for values in prior_values(record.experiment)]


def prior_values(experiment: "Experiment") -> list[dict[str, Any]]:
    """Values of all unknowns by name, at draws from their priors."""
    draws = draws_from_priors(experiment.unknowns, 0, DRAWS)
    return [{name: values[draw] for name, values in draws.items()} for draw in range(DRAWS)]


def _receptance(experiment: "Experiment") -> Receptance:
    return experiment.receptance()
