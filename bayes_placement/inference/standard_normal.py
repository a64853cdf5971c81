"""Coordinates of the unknowns in which every prior is standard normal.

There the prior is independent, of mean zero and of variance one, so a uniform prior is a soft wall
and least squares needs no bounds.
"""

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
from .symmetries import Values


class StandardNormalCoordinates:
    """One vector for all unknowns, each component standard normal under the prior.

    Parameters
    ----------
    priors
        Prior of each unknown by name, with an inverse distribution function.
    """

    def __init__(self, priors: dict[str, Distribution]):
        self.priors = priors
        self.places: dict[str, slice] = {}
        end = 0
        for name, prior in priors.items():
            self.places[name] = slice(end, end + max(1, _size(prior)))
            end = self.places[name].stop
        self.dimension = end

    def values(self, coordinates: Float[Array, "unknown"]) -> Values:
        """Values by name.

        Raises
        ------
        InfeasibleError
            If a prior has no inverse distribution function.
        """
        probability = ndtr(coordinates)  # of all at once: it is many operations to compile
        values = {}
        for name, prior in self.priors.items():
            place, shape = self.places[name], prior.shape()
            pair = coordinates[place].reshape(shape), probability[place].reshape(shape)
            values[name] = _value(prior, *pair, name)
        return values

    def named(self, points: np.ndarray) -> dict[str, np.ndarray]:
        """Values by name at several points [point, unknown]."""
        if len(points) == 0:
            return {name: np.zeros((0, *prior.shape())) for name, prior in self.priors.items()}
        values = {}
        for name, prior in self.priors.items():
            normal = points[:, self.places[name]].reshape(-1, *prior.shape())
            value = _value_in_numpy(prior, normal)
            if value is None:
                return jax.tree.map(np.asarray, jax.jit(jax.vmap(self.values))(points))
            values[name] = value
        return values


def _size(prior: Distribution) -> int:
    return int(jnp.zeros(prior.shape()).size)


def _value_in_numpy(prior: Distribution, normal: np.ndarray) -> np.ndarray | None:
    """Values of common distributions without compiling anything; None of any other."""
    if isinstance(prior, Independent):
        return _value_in_numpy(prior.base_dist, normal)
    if isinstance(prior, Normal):
        return np.asarray(prior.loc) + np.asarray(prior.scale) * normal
    if isinstance(prior, Uniform):
        low, high = np.asarray(prior.low), np.asarray(prior.high)
        return low + (high - low) * special.ndtr(normal)
    if isinstance(prior, TransformedDistribution):
        base = _value_in_numpy(prior.base_dist, normal)
        if base is not None and [type(part) for part in prior.transforms] == [ExpTransform]:
            return np.exp(base)
    return None


def _value(prior: Distribution, normal: Array, probability: Array, name: str) -> Array:
    if isinstance(prior, Independent):
        return _value(prior.base_dist, normal, probability, name)
    if isinstance(prior, Normal):
        return prior.loc + prior.scale * normal
    if isinstance(prior, Uniform):
        return prior.low + (prior.high - prior.low) * probability
    if isinstance(prior, TransformedDistribution):
        value = _value(prior.base_dist, normal, probability, name)
        for transform in prior.transforms:
            value = transform(value)
        return value
    try:
        return jnp.broadcast_to(prior.icdf(probability), prior.shape())
    except (NotImplementedError, ImportError) as error:  # some inverses need TensorFlow
        raise InfeasibleError(
            f'The unknown "{name}" has the distribution {type(prior).__name__}, which lacks an '
            "inverse distribution function; a fit in standard normal coordinates needs it. Give a "
            "Uniform, LogUniform, Normal or LogNormal distribution."
        ) from error
