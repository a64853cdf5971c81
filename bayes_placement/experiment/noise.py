"""Output error: the Gaussian distribution of measured outputs around predicted ones, Eq. (21)."""

import abc
from collections.abc import Sequence
from typing import Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool
from numpyro.distributions import Distribution, MultivariateNormal, Normal

from .._sites import is_unknown, unit
from .._types import InputError, Parameter, Response

Chosen: TypeAlias = slice | np.ndarray
"""Some channels: a slice of them, or their numbers."""


class Data(eqx.Module):
    """Measured outputs, in the shape of the predicted ones.

    Parameters
    ----------
    z
        Measured outputs; zero where nothing was measured.
    measured
        Where something was measured.
    deviation
        Standard deviation of each output known from coherence and averages, or None.
    """

    z: Response
    measured: Bool[np.ndarray, "sensor actuator *level_and_part frequency"]
    deviation: Response | None = None

    def of(self, sensors: Any = slice(None), actuators: Any = slice(None)) -> "Data":
        """Return the data of some sensor and actuator channels."""

        def pick(values: Any) -> Any:
            return None if values is None else values[sensors][:, actuators]

        return Data(pick(self.z), pick(self.measured), pick(self.deviation))

    @staticmethod
    def at_levels(runs: "Sequence[Data]") -> "Data":
        """Return the data of several force levels, one run each, as one."""

        def stacked(values: list[Any]) -> Any:
            xp = np if isinstance(values[0], np.ndarray) else jnp
            return None if values[0] is None else xp.stack(values, axis=2)

        names = ("z", "measured", "deviation")
        return Data(*(stacked([getattr(run, name) for run in runs]) for name in names))


class Noise(eqx.Module):
    """Distribution of the output error N in Z_obs = Z + N."""

    reads_coherence: eqx.AbstractClassVar[bool]

    @abc.abstractmethod
    def distribution(
        self, predicted: Response, data: Data | None, kernel: Any = 0.0
    ) -> Distribution:
        """Distribution of the measured outputs around the predicted ones.

        Parameters
        ----------
        predicted
            Outputs of the model.
        data
            Measured outputs and their known standard deviations; None in a simulation.
        kernel
            Variance added to each output: a kernel density estimate with Gaussian kernels plus
            Gaussian noise is again Gaussian (Eq. 29 in closed form).
        """

    def check(self, data: Data) -> None:
        """Refuse data that this noise cannot treat.

        Raises
        ------
        InputError
            If this noise cannot treat them.
        """
        return

    def deviation(self, data: Data) -> Response | None:
        """Standard deviation of each output, in the unit of z; None where it is not known."""
        return None

    def of(self, sensors: Chosen = slice(None), actuators: Chosen = slice(None)) -> "Noise":
        """Return the noise of some sensor and actuator channels."""
        return self


class Gaussian(Noise):
    """Independent Gaussian errors of a given or unknown standard deviation.

    Parameters
    ----------
    sigma
        Standard deviation of z, in the unit of z (for a complex FRF, of each of its parts): a
        number, an array (sensor, actuator, frequency) whose axes may have length one, an array
        that broadcasts to all outputs, or a distribution.
    """

    reads_coherence = False
    sigma: Parameter = eqx.field(metadata=unit("unit of z"))

    def __init__(self, sigma: Parameter):
        self.sigma = _positive("noise.Gaussian(sigma)", "standard deviation", sigma)

    def distribution(
        self, predicted: Response, data: Data | None, kernel: Any = 0.0
    ) -> Distribution:
        """Independent normal distribution of every output."""
        sigma = _as_outputs(self.sigma, predicted)
        return _masked(Normal(predicted, jnp.sqrt(sigma**2 + kernel)), data)

    def deviation(self, data: Data) -> Response | None:
        """Return sigma for every output; None where it is a distribution."""
        return None if is_unknown(self.sigma) else _as_outputs(self.sigma, data.z)

    def of(self, sensors: Chosen = slice(None), actuators: Chosen = slice(None)) -> "Gaussian":
        """Return the noise of some channels, where each has a level of its own."""
        level = self.sigma
        by_channel = not is_unknown(level) and jnp.ndim(level) == 3  # type: ignore[arg-type]
        return Gaussian(_channels(jnp.asarray(level), sensors, actuators)) if by_channel else self


class Covariance(Noise):
    """Gaussian errors that are correlated along the lines of a channel.

    Parameters
    ----------
    matrix
        Covariance of the outputs of one channel pair along frequency [(unit of z)^2], a matrix or
        a distribution of matrices.
    scale
        Factor on the standard deviation [1], a number or a distribution.
    """

    reads_coherence = False
    matrix: Parameter = eqx.field(metadata=unit("(unit of z)^2"))
    scale: Parameter = eqx.field(metadata=unit("1"))

    def __init__(self, matrix: Parameter, scale: Parameter = 1.0):
        self.matrix = _positive_definite(matrix)
        self.scale = _positive("noise.Covariance(matrix, scale)", "scale", scale)

    def distribution(
        self, predicted: Response, data: Data | None, kernel: Any = 0.0
    ) -> Distribution:
        """Joint normal distribution of the lines of each channel pair."""
        if data is not None and isinstance(data.measured, np.ndarray):
            self.check(data)  # inputs of a compiled function were checked before
        extra = jnp.asarray(kernel)[..., None] * jnp.eye(predicted.shape[-1])
        matrix = jnp.asarray(self.matrix) * jnp.asarray(self.scale) ** 2
        return MultivariateNormal(predicted, matrix + extra)

    def check(self, data: Data) -> None:
        """Refuse data with gaps."""
        if not data.measured.all():
            raise InputError(
                "noise.Covariance needs every sensor measured for every actuator at every line, "
                "but some pairs are missing. Use noise.Gaussian, or select measured channels."
            )


class FromCoherence(Noise):
    """Independent errors at each line, known from coherence and averages.

    E|error|^2 = |H|^2 (1 - coherence) / (averages coherence) for an FRF by the H1 estimator, half
    of it in the real part and half in the imaginary part (Bendat and Piersol, Random Data, ch. 9).

    Parameters
    ----------
    factor
        Factor on the standard deviation [1]: 1, or a distribution where the coherence does not
        contain all errors.
    """

    reads_coherence = True
    factor: Parameter = eqx.field(metadata=unit("1"))

    def __init__(self, factor: Parameter = 1.0):
        self.factor = _positive("noise.FromCoherence(factor)", "factor", factor)

    def distribution(
        self, predicted: Response, data: Data | None, kernel: Any = 0.0
    ) -> Distribution:
        """Independent normal distribution of every output."""
        if data is None or data.deviation is None:
            raise InputError(
                "noise.FromCoherence reads its level from the coherence and the averages of a "
                "measurement, and none is given here. Give a measurement with both, or use "
                "noise.Gaussian(sigma)."
            )
        deviation = data.deviation * jnp.asarray(self.factor)
        return _masked(Normal(predicted, jnp.sqrt(deviation**2 + kernel)), data)

    def deviation(self, data: Data) -> Response | None:
        """Return the known deviation times the factor; None where this is a distribution."""
        if is_unknown(self.factor) or data.deviation is None:
            return None
        return data.deviation * jnp.asarray(self.factor)


def _positive(call: str, word: str, value: Parameter) -> Parameter:
    """Return a standard deviation, or a factor on one, if it is positive or a distribution.

    Raises
    ------
    InputError
        If it is not positive and finite.
    """
    if is_unknown(value) or isinstance(value, jax.core.Tracer):
        return value
    wrong = np.asarray(value)[~(np.isfinite(value) & (np.asarray(value) > 0))]
    if wrong.size:
        raise InputError(
            f"{call} was given a {word} of {wrong[0]:g}; the {word} must be positive, since a "
            "likelihood without noise is infinite. Without output error give noise=None and use "
            "marginals.KDE()."
        )
    return value


def _positive_definite(matrix: Parameter) -> Parameter:
    """Return a covariance if it is positive definite or a distribution.

    Raises
    ------
    InputError
        If it is not square and positive definite.
    """
    if is_unknown(matrix) or isinstance(matrix, jax.core.Tracer):
        return matrix
    try:
        np.linalg.cholesky(np.asarray(matrix))
    except np.linalg.LinAlgError as error:
        raise InputError(
            f"noise.Covariance(matrix) was given a matrix of shape {np.shape(matrix)} that is not "
            "square and positive definite; that is needed, since the density has its inverse. Take "
            "the covariance of more records than lines, or add a variance: "
            "matrix + 1e-6 * np.eye(lines)."
        ) from error
    return matrix


def _channels(sigma: Array, sensors: Chosen, actuators: Chosen) -> Array:
    sigma = sigma[sensors] if sigma.shape[0] > 1 else sigma
    return sigma[:, actuators] if sigma.shape[1] > 1 else sigma


def _as_outputs(sigma: Any, predicted: Response) -> Array:
    level = jnp.asarray(sigma)
    if level.ndim == 3:  # common to all force levels and both parts of a complex FRF
        between = tuple(range(2, predicted.ndim - 1))
        level = jnp.expand_dims(level, between)
    return jnp.broadcast_to(level, predicted.shape)


def _masked(distribution: Distribution, data: Data | None) -> Distribution:
    return distribution if data is None else distribution.mask(data.measured)
