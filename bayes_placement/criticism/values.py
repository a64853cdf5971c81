"""Values of unknowns, arrays together or one by one, and what a model predicts with them."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._shared.dimensions import Response
from ..experiment.experiment import Experiment
from ..experiment.noise import Data
from ..inference.engines.levenberg_marquardt import LARGEST
from ..inference.estimates import Number, from_scalars, scalars
from ..inference.residuals import Problem


def with_arrays(experiment: Experiment, values: Mapping[str, float]) -> dict[str, Number]:
    """Values of the unknowns by name, the elements of an array put together.

    Elements of an array are given one by one (`structure.damping.ratio[0]`).
    """
    shapes = {unknown.name: unknown.distribution.shape() for unknown in experiment.unknowns}
    return from_scalars(shapes, values)


def in_scalars(values: Mapping[str, object]) -> dict[str, float]:
    """Values by name, the elements of an array one by one; what `with_arrays` puts together."""
    return {
        word: float(value[0, 0])
        for name, known in values.items()
        for word, value in scalars(name, np.asarray(known)[None, None])
    }


def point_of(problem: Problem, values: Mapping[str, float]) -> Float[np.ndarray, "unknown"]:
    """Coordinates of values of the unknowns; at an edge of a prior a little inside.

    Sizes of model errors are known; elements of arrays are given one by one.
    """
    named = with_arrays(problem.at_fixed_sizes, values)
    vector = np.asarray(problem.coordinates.vector(named), dtype=float)
    return np.clip(np.nan_to_num(vector), -LARGEST, LARGEST)


def prediction(concrete: Experiment, data: Data) -> tuple[Response, Response]:
    """Predicted outputs and the variance of the noise of each, of a model without unknowns."""
    assert concrete.noise is not None
    predicted = concrete.predict()
    error = concrete.noise.distribution(predicted, data)
    return predicted, jnp.broadcast_to(error.variance, predicted.shape)
