"""An experiment with data as a problem of least squares over standard normal coordinates."""

from collections.abc import Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import MaskedDistribution, MultivariateNormal

from .._compiled import Bound, compiled
from .._sites import Role, Unknown
from .._types import InputError
from ..experiment.experiment import Experiment
from ..experiment.model_error import ModalErrors
from ..experiment.noise import Data
from ..experiment.observe import Complex
from .coordinates import Coordinates
from .engines.least_squares import BATCH, LeastSquares

LOGARITHMIC_ERROR = 0.1
"""Relative error by which a logarithmic residual is divided."""


class Problem:
    """Least squares of an experiment against data.

    Parameters
    ----------
    experiment
        Experiment with Gaussian noise.
    data
        Measured outputs.
    standard_normal
        Whether the prior has to be standard normal in the coordinates.
    sizes
        Sizes of the model error by name, where they are unknown: their joint mode with the errors
        means nothing, so that they are no coordinates but numbers. By default the medians of their
        priors.
    rival
        Model error that the experiment does not have: it is held at zero. One compiled function
        then serves the experiment with it and without it.

    Raises
    ------
    InfeasibleError
        If the prior has to be standard normal, and has no inverse distribution function.
    """

    def __init__(
        self,
        experiment: Experiment,
        data: Data,
        *,
        standard_normal: bool = True,
        sizes: Mapping[str, float] | None = None,
        rival: ModalErrors | None = None,
    ):
        if experiment.noise is None:
            raise InputError(
                "The experiment has noise=None, so residuals cannot be compared with the noise. "
                "Give it noise.Gaussian(sigma) or noise.FromCoherence()."
            )
        experiment.noise.check(data)
        self.experiment = experiment
        self.data = data
        self.rival = rival
        self.unknown_sizes: Sequence[Unknown] = sizes_of(experiment)
        self.sizes = dict(sizes or _medians(self.unknown_sizes))
        self.at_fixed_sizes = experiment.fix(self.sizes)
        self.coordinates = coordinates_of(self.at_fixed_sizes, standard_normal=standard_normal)
        form = self._form()
        self._size = coordinates_of(form, standard_normal=standard_normal).dimension
        self._evaluate: Bound[tuple[Array, Array]] = compiled(_residuals).bound(form, data)
        self.squares = LeastSquares(
            self._padded, self.dimension, int(np.sum(np.asarray(data.measured)))
        )

    def _form(self) -> Experiment:
        """The experiment with the model error that is held at zero."""
        if self.rival is None:
            return self.at_fixed_sizes
        form = self.at_fixed_sizes.with_errors(self.rival)
        return form.fix(_medians(sizes_of(form)))

    def _padded(self, points: Any, logarithmic: Any) -> tuple[Array, Array]:
        """Residuals with errors of zero; these are the last unknowns of an experiment."""
        width = self._size - self.dimension
        return self._evaluate(
            jnp.pad(points, ((0, 0), (0, width))) if width else points, logarithmic
        )

    @property
    def dimension(self) -> int:
        """Number of unknowns."""
        return self.coordinates.dimension

    @property
    def count(self) -> int:
        """Number of data."""
        return self.squares.count

    def at_sizes(self, sizes: Mapping[str, float]) -> "Problem":
        """Return the problem at other sizes of the model error."""
        problem = Problem(self.experiment, self.data, sizes=sizes)
        problem.squares.take_structure(self.squares)
        return problem

    def weight(self, relative_error: float) -> np.ndarray | None:
        """Weight of each residual once FRFs have a further relative error.

        None without such an error, and where the noise is unknown, which takes it up by itself.
        """
        noise = self.experiment.noise
        deviation = None if noise is None else noise.deviation(self.data)
        if relative_error == 0 or deviation is None:
            return None
        known = np.asarray(deviation)
        further = relative_error * self.experiment.observe.relative(np.asarray(self.data.z))
        return np.ravel(known / np.hypot(known, further))

    def errors_of(self, size: Unknown) -> np.ndarray:
        """Places of the errors that have a size, among the coordinates."""
        places = [
            np.arange(place.start, place.stop)
            for unknown in self.experiment.unknowns
            if unknown.owner == size.owner and unknown.name in self.coordinates.places
            for place in [self.coordinates.places[unknown.name]]
        ]
        return np.concatenate(places)

    def with_sizes(self, points: np.ndarray, sizes: Mapping[str, np.ndarray]) -> np.ndarray:
        """Coordinates of all unknowns of the experiment, from those here and sizes by name."""
        everything = coordinates_of(self.experiment)
        vectors = np.zeros((len(points), everything.dimension))
        for name, place in everything.places.items():
            if name in self.coordinates.places:
                vectors[:, place] = points[:, self.coordinates.places[name]]
        for size in self.unknown_sizes:
            score = Coordinates({size.name: size.distribution}).vector
            scores = jax.vmap(lambda value, n=size.name, f=score: f({n: value}))(sizes[size.name])
            vectors[:, everything.places[size.name]] = np.asarray(scores)
        return vectors

    def without_sizes(self, points: np.ndarray) -> np.ndarray:
        """Coordinates here, from those of all unknowns of the experiment."""
        everything = coordinates_of(self.experiment)
        kept = [points[:, everything.places[name]] for name in self.coordinates.places]
        return np.concatenate(kept, axis=1)

    def prepare(self) -> None:
        """Compile the residuals, unless that is done. Any thread may."""
        self._evaluate.prepare(np.zeros((BATCH, self._size)), False)


def sizes_of(experiment: Experiment) -> tuple[Unknown, ...]:
    """Sizes of the model error that are unknown."""
    return tuple(
        unknown
        for unknown in experiment.unknowns
        if unknown.role is Role.MODEL_ERROR and unknown.field == "size"
    )


def _medians(unknowns: Sequence[Unknown]) -> dict[str, float]:
    priors = {unknown.name: unknown.distribution for unknown in unknowns}
    coordinates = Coordinates(priors)
    return {
        name: float(value[0])
        for name, value in coordinates.named(np.zeros((1, coordinates.dimension))).items()
    }


def coordinates_of(experiment: Experiment, *, standard_normal: bool = True) -> Coordinates:
    """Coordinates of the unknowns of an experiment.

    Raises
    ------
    InfeasibleError
        If the prior has to be standard normal, and one has no inverse distribution function.
    """
    distributions = {unknown.name: unknown.distribution for unknown in experiment.unknowns}
    return Coordinates(distributions, standard_normal=standard_normal)


def _residuals(
    experiment: Experiment, data: Data, points: Float[Array, "point unknown"], logarithmic: Any
) -> tuple[Array, Array]:
    """Residuals of a batch of points, all numbers of the experiment being inputs."""
    coordinates = coordinates_of(experiment, standard_normal=False)

    def at(point: Float[Array, "unknown"]) -> tuple[Array, Array]:
        return _residual(experiment.fix(coordinates.values(point)), data, logarithmic)

    return jax.vmap(at)(points)


def _residual(known: Experiment, data: Data, logarithmic: Any) -> tuple[Array, Array]:
    frf = known.frf()
    assert known.noise is not None
    distribution = known.noise.distribution(known.observe.output(frf), data)
    plain, log_scale = standardised(distribution, data)
    if not isinstance(known.observe, Complex):
        return plain, log_scale
    return jnp.where(logarithmic, _logarithmic(frf, data), plain), log_scale


def standardised(distribution: Any, data: Data) -> tuple[Array, Array]:
    """Residuals over their standard deviations and the sum of the logs of these.

    Zero where nothing was measured.
    """
    base = distribution.base_dist if isinstance(distribution, MaskedDistribution) else distribution
    error = data.z - base.mean
    if isinstance(base, MultivariateNormal):
        scale = base.scale_tril
        plain = jax.scipy.linalg.solve_triangular(scale, error[..., None], lower=True)[..., 0]
        return plain.ravel(), jnp.sum(jnp.log(jnp.diagonal(scale, axis1=-2, axis2=-1)))
    deviation = jnp.broadcast_to(base.scale, error.shape)
    logs = jnp.sum(jnp.where(data.measured, jnp.log(deviation), 0.0))
    return jnp.where(data.measured, error / deviation, 0.0).ravel(), logs


def _logarithmic(frf: Array, data: Data) -> Array:
    """Residual of the complex logarithm, the phase wrapped to its principal value."""
    measured = data.z[..., 0, :] + 1j * data.z[..., 1, :]
    ratio = jnp.where(data.measured[..., 0, :], frf / measured, 1.0)
    ratio = jnp.where(jnp.abs(ratio) > 1e-12, ratio, 1e-12)
    parts = jnp.stack([jnp.log(jnp.abs(ratio)), jnp.angle(ratio)], axis=-2)
    return parts.ravel() / LOGARITHMIC_ERROR
