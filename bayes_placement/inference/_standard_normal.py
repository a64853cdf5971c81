"""_standard_normal: in, priors of some unknowns; out, their values at standard normal coordinates.

Not known here: models, data. In these coordinates every prior is the same: independent, of mean
zero and of variance one, so a uniform prior is a soft wall and least squares needs no bounds.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import ndtr
from jaxtyping import Array, Float
from numpyro.distributions import (
    Distribution,
    Independent,
    Normal,
    TransformedDistribution,
    Uniform,
)
from numpyro.distributions.transforms import ExpTransform
from scipy import special

from .._types import InfeasibleError

Values = dict[str, Any]


class Coordinates:
    """One vector for all unknowns, each component standard normal under the prior.

    Parameters
    ----------
    laws
        Prior of each unknown by name, with an inverse distribution function.
    """

    def __init__(self, laws: dict[str, Distribution]):
        self.laws = laws
        self.places: dict[str, slice] = {}
        end = 0
        for name, law in laws.items():
            self.places[name] = slice(end, end + max(1, _size(law)))
            end = self.places[name].stop
        self.dimension = end

    def values(self, coordinates: Float[Array, "unknown"]) -> Values:
        """Values by name.

        Raises
        ------
        InfeasibleError
            If a law has no inverse distribution function.
        """
        probability = ndtr(coordinates)  # of all at once: it is many operations to compile
        values = {}
        for name, law in self.laws.items():
            place, shape = self.places[name], law.shape()
            pair = coordinates[place].reshape(shape), probability[place].reshape(shape)
            values[name] = _value(law, *pair, name)
        return values

    def named(self, points: np.ndarray) -> dict[str, np.ndarray]:
        """Values by name at several points [point, unknown]."""
        if len(points) == 0:
            return {name: np.zeros((0, *law.shape())) for name, law in self.laws.items()}
        found = {}
        for name, law in self.laws.items():
            value = _plain(law, points[:, self.places[name]].reshape(-1, *law.shape()))
            if value is None:
                return jax.tree.map(np.asarray, jax.jit(jax.vmap(self.values))(points))
            found[name] = value
        return found


def _size(law: Distribution) -> int:
    return int(jnp.zeros(law.shape()).size)


def _plain(law: Distribution, normal: np.ndarray) -> np.ndarray | None:
    """Values of common laws without compiling anything; None of any other law."""
    if isinstance(law, Independent):
        return _plain(law.base_dist, normal)
    if isinstance(law, Normal):
        return np.asarray(law.loc) + np.asarray(law.scale) * normal
    if isinstance(law, Uniform):
        low, high = np.asarray(law.low), np.asarray(law.high)
        return low + (high - low) * special.ndtr(normal)
    if isinstance(law, TransformedDistribution):
        base = _plain(law.base_dist, normal)
        if base is not None and [type(one) for one in law.transforms] == [ExpTransform]:
            return np.exp(base)
    return None


def _value(law: Distribution, normal: Array, probability: Array, name: str) -> Array:
    if isinstance(law, Independent):
        return _value(law.base_dist, normal, probability, name)
    if isinstance(law, Normal):
        return law.loc + law.scale * normal
    if isinstance(law, Uniform):
        return law.low + (law.high - law.low) * probability
    if isinstance(law, TransformedDistribution):
        value = _value(law.base_dist, normal, probability, name)
        for transform in law.transforms:
            value = transform(value)
        return value
    try:
        return jnp.broadcast_to(law.icdf(probability), law.shape())
    except (NotImplementedError, ImportError) as error:  # some inverses need TensorFlow
        raise InfeasibleError(
            f'The unknown "{name}" has the law {type(law).__name__}, which lacks an inverse '
            "distribution function; a fit in standard normal coordinates needs it. Give a "
            "Uniform, LogUniform, Normal or LogNormal law."
        ) from error
