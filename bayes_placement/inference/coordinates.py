"""Vector of all unknowns in coordinates in which the prior is standard normal.

In these coordinates the bounds of a uniform prior lie at infinity and all unknowns have the same
scale, so that least squares need no bounds. Unknowns whose distribution cannot be inverted have the
unconstrained coordinates of NumPyro.
"""

from collections import OrderedDict
from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import ndtr, ndtri
from jaxtyping import Array, Float
from numpyro.distributions import (
    Distribution,
    Normal,
    TransformedDistribution,
    Uniform,
    biject_to,
)

from .._shared.compiled import compiled
from .._shared.errors import InfeasibleError
from .._shared.ranges import ALIKE, plain_quantile
from .estimates import Given, Number
from .symmetries import Values

Vector = Float[Array, "unknown"]


class Coordinates:
    """Map between the values of independent unknowns by name and a vector of coordinates.

    The prior of every coordinate may have to be standard normal.
    """

    def __init__(self, priors: Mapping[str, Distribution], *, standard_normal: bool = True):
        self.priors = dict(priors)
        bijective = [name for name, prior in self.priors.items() if not _invertible(prior)]
        if standard_normal and bijective:
            raise InfeasibleError(
                f'The unknown "{bijective[0]}" has the distribution '
                f"{type(self.priors[bijective[0]]).__name__}, which lacks an inverse "
                "distribution function; a fit in standard normal coordinates needs it. Give a "
                "Uniform, LogUniform, Normal or LogNormal distribution."
            )
        self.bijections = {name: biject_to(self.priors[name].support) for name in bijective}
        self.places: dict[str, slice] = {}
        end = 0
        for name in self.priors:
            self.places[name] = slice(end, end + int(np.prod(self._shape(name))))
            end = self.places[name].stop
        self.dimension = end

    def values(self, vector: Vector) -> Values:
        """Values by name."""
        probability = ndtr(vector)  # of all coordinates at once, since it is slow to compile
        values = {}
        for name, prior in self.priors.items():
            place, shape = self.places[name], self._shape(name)
            coordinate = vector[place].reshape(shape)
            if name in self.bijections:
                values[name] = self.bijections[name](coordinate)
            else:
                values[name] = _quantile(prior, coordinate, probability[place], shape)
        return values

    def vector(self, values: Given) -> Vector:
        """Vector of values by name; not finite where a value lies outside its prior."""
        if not self.priors:
            return jnp.zeros(0)
        return jnp.concatenate(
            [
                jnp.ravel(
                    self.bijections[name].inv(values[name])
                    if name in self.bijections
                    else _score(prior, values[name])
                )
                for name, prior in self.priors.items()
            ]
        )

    def log_prior(self, vector: Vector, names: Sequence[str] | None = None) -> Float[Array, ""]:
        """Log prior density of the coordinates of the named unknowns, or of all."""
        values = self.values(vector) if self.bijections else {}
        total = jnp.zeros(())
        for name in self.priors if names is None else names:
            if name in self.bijections:
                density = self.priors[name].log_prob(values[name])
                total += jnp.sum(density) + self._log_volume(name, vector, values)
            else:
                total += _log_standard_normal(vector[self.places[name]])
        return total

    def log_jacobian(self, vector: Vector, names: Sequence[str] | None = None) -> Float[Array, ""]:
        """Log determinant of the derivative of the named values, or of all, by coordinates."""
        values = self.values(vector)
        total = jnp.zeros(())
        for name in self.priors if names is None else names:
            if name in self.bijections:
                total += self._log_volume(name, vector, values)
            else:
                density = jnp.sum(self.priors[name].log_prob(values[name]))
                total += _log_standard_normal(vector[self.places[name]]) - density
        return total

    def named(self, points: np.ndarray) -> dict[str, np.ndarray]:
        """Values by name at points [point, unknown]."""
        if len(points) == 0:
            return {name: np.zeros((0, *prior.shape())) for name, prior in self.priors.items()}
        if self.bijections:
            priors = OrderedDict(self.priors)  # JAX sorts the names in other dictionaries
            return jax.tree.map(np.asarray, compiled(_named)(priors, points))
        values = {}
        for name, prior in self.priors.items():
            coordinate = points[:, self.places[name]].reshape(-1, *self._shape(name))
            value = plain_quantile(prior, coordinate)
            values[name] = (
                np.asarray(compiled(_quantiles)(prior, coordinate)) if value is None else value
            )
        return values

    @property
    def count(self) -> int:
        """How many numbers the values are."""
        return sum(int(np.prod(prior.shape())) for prior in self.priors.values())

    def numbers(
        self, points: Float[np.ndarray, "point unknown"]
    ) -> Float[np.ndarray, "point number"]:
        """Values of all unknowns, one after the other, at points."""
        columns = [value.reshape(len(points), -1) for value in self.named(points).values()]
        return np.concatenate([np.zeros((len(points), 0)), *columns], axis=1)

    def _shape(self, name: str) -> tuple[int, ...]:
        shape = self.priors[name].shape()
        return self.bijections[name].inverse_shape(shape) if name in self.bijections else shape

    def _log_volume(self, name: str, vector: Vector, values: Values) -> Array:
        coordinate = vector[self.places[name]].reshape(self._shape(name))
        return jnp.sum(self.bijections[name].log_abs_det_jacobian(coordinate, values[name]))


def _named(priors: Mapping[str, Distribution], points: Float[Array, "point unknown"]) -> Values:
    """Values by name at points [point, unknown]."""
    return jax.vmap(Coordinates(priors, standard_normal=False).values)(points)


def _log_standard_normal(vector: Array) -> Array:
    return -0.5 * vector @ vector - 0.5 * vector.size * jnp.log(2 * jnp.pi)


def _quantile(
    distribution: Distribution, normal: Array, probability: Array, shape: tuple[int, ...]
) -> Array:
    """Value at a standard normal coordinate of this probability."""
    probability = probability.reshape(shape)
    if isinstance(distribution, ALIKE):
        return _quantile(distribution.base_dist, normal, probability, shape)
    if isinstance(distribution, Normal):
        return distribution.loc + distribution.scale * normal
    if isinstance(distribution, Uniform):
        return distribution.low + (distribution.high - distribution.low) * probability
    if isinstance(distribution, TransformedDistribution):
        value = _quantile(distribution.base_dist, normal, probability, shape)
        for transform in distribution.transforms:
            value = transform(value)
        return value
    return jnp.broadcast_to(distribution.icdf(probability), shape)


def _quantiles(distribution: Distribution, normal: Array) -> Array:
    """Values at standard normal coordinates [point, ...]."""

    def at(normal: Array) -> Array:
        return _quantile(distribution, normal, ndtr(normal), normal.shape)

    return jax.vmap(at)(normal)


def _score(distribution: Distribution, value: Number) -> Array:
    """Standard normal coordinate of a value: the inverse of `_quantile`."""
    if isinstance(distribution, ALIKE):
        return _score(distribution.base_dist, value)
    if isinstance(distribution, Normal):
        return (value - distribution.loc) / distribution.scale
    if isinstance(distribution, Uniform):
        return ndtri((value - distribution.low) / (distribution.high - distribution.low))
    if isinstance(distribution, TransformedDistribution):
        for transform in reversed(distribution.transforms):
            value = transform.inv(value)
        return _score(distribution.base_dist, value)
    return ndtri(distribution.cdf(value))


def _invertible(distribution: Distribution) -> bool:
    """Tell whether values and standard normal coordinates can be converted in both directions."""
    while isinstance(distribution, (*ALIKE, TransformedDistribution)):
        if any(step.domain.event_dim > 0 for step in getattr(distribution, "transforms", ())):
            return False
        distribution = distribution.base_dist
    return isinstance(distribution, Normal | Uniform) or (
        _has(distribution, "icdf") and _has(distribution, "cdf")
    )


def _has(distribution: Distribution, method: str) -> bool:
    """Tell whether a distribution or its inverse distribution function is implemented."""
    probability = jnp.full(distribution.shape(), 0.5)
    try:
        jax.eval_shape(getattr(distribution, method), probability)
    except (NotImplementedError, ImportError):  # some inverses need TensorFlow
        return False
    return True
