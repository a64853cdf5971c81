"""Output error: the Gaussian distribution of measured outputs around predicted ones, Eq. (21)."""

import abc
from typing import ClassVar, TypeAlias

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from numpyro.distributions import Distribution, MultivariateNormal, Normal

from .._shared.dimensions import Parameter, Response
from .._shared.errors import InputError
from .._shared.ranges import POSITIVE, SHARE_OF_AMPLITUDE
from .._shared.reprs import with_short_repr
from .._shared.sites import is_unknown, unit
from ._value_checks import check_lines, not_negative, positive, positive_definite
from .measurement import Measurement
from .observation import Chosen, Data

Words: TypeAlias = tuple[str, str]


@with_short_repr
class Noise(eqx.Module):
    """Distribution of the output error N in Z_obs = Z + N.

    Attributes
    ----------
    reads_amplitude
        Whether its level is read from the amplitude of the measured FRFs.
    reads_variance
        Whether its level is read from the variance that a measurement states.

    Examples
    --------
    >>> isinstance(bp.noise.Gaussian(0.1), bp.noise.Noise)
    True
    """

    reads_amplitude: ClassVar[bool] = False
    reads_variance: ClassVar[bool] = False

    @property
    @abc.abstractmethod
    def reads_coherence(self) -> bool:
        """Whether its level is read from the coherence of a measurement."""

    @property
    def reads_measurement(self) -> bool:
        """Whether its level is read from a measurement."""
        return self.reads_coherence or self.reads_amplitude

    def variance(self, measurement: Measurement) -> np.ndarray | None:
        """Variance E|error|^2 of each FRF value, where it is read from a measurement.

        Raises
        ------
        InputError
            If the measurement does not have what it is read from.
        """
        return measurement.noise_variance() if self.reads_coherence else None

    @abc.abstractmethod
    def distribution(
        self, predicted: Response, data: Data | None, kernel: float | Array = 0.0
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

    Examples
    --------
    >>> float(bp.noise.Gaussian(dist.LogUniform(1e-6, 1e-3)).sigma.high)
    0.001
    """

    reads_coherence: ClassVar[bool] = False
    sigma: Parameter = eqx.field(metadata=unit("unit of z", within=POSITIVE))

    def __init__(self, sigma: Parameter):
        self.sigma = positive("noise.Gaussian(sigma)", "standard deviation", sigma)

    def distribution(
        self, predicted: Response, data: Data | None, kernel: float | Array = 0.0
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
    factor
        Factor on the standard deviation [1], a number or a distribution.

    Examples
    --------
    >>> distance = np.subtract.outer(experiment.frequency, experiment.frequency)
    >>> bp.noise.Covariance(1e-10 * np.exp(-np.abs(distance) / 100.0), factor=2.0).factor
    2.0
    """

    reads_coherence: ClassVar[bool] = False
    matrix: Parameter = eqx.field(metadata=unit("(unit of z)^2"))
    factor: Parameter = eqx.field(metadata=unit("1", within=POSITIVE))

    def __init__(self, matrix: Parameter, factor: Parameter = 1.0):
        self.matrix = positive_definite(matrix)
        self.factor = positive("noise.Covariance(matrix, factor)", "factor", factor)

    def distribution(
        self, predicted: Response, data: Data | None, kernel: float | Array = 0.0
    ) -> Distribution:
        """Joint normal distribution of the lines of each channel pair."""
        if data is not None and isinstance(data.measured, np.ndarray):
            self.check(data)  # inputs of a compiled function were checked before
        extra = jnp.asarray(kernel)[..., None] * jnp.eye(predicted.shape[-1])
        matrix = jnp.asarray(self.matrix) * jnp.asarray(self.factor) ** 2
        return MultivariateNormal(predicted, matrix + extra)

    def check(self, data: Data) -> None:
        """Refuse data with gaps."""
        if not data.measured.all():
            raise InputError(
                "noise.Covariance needs every sensor measured for every actuator at every line, "
                "but some pairs are missing. Use noise.Gaussian, or select measured channels."
            )
        check_lines(self.matrix, data.measured.shape[-1])


class _OfMeasurement(Noise):
    """Independent errors at each line, whose deviations are read from a measurement."""

    reads_coherence: ClassVar[bool] = False
    reads_measurement: ClassVar[bool] = True  # type: ignore[misc]
    source: ClassVar[Words]  # what they are read from, and which measurement has it
    factor: Parameter = eqx.field(default=1.0, metadata=unit("1", within=POSITIVE))

    def __init__(self, factor: Parameter = 1.0):
        self.factor = positive(f"noise.{type(self).__name__}(factor)", "factor", factor)

    def distribution(
        self, predicted: Response, data: Data | None, kernel: float | Array = 0.0
    ) -> Distribution:
        """Independent normal distribution of every output."""
        if data is None or data.deviation is None:
            what, where = self.source
            raise InputError(
                f"noise.{type(self).__name__} reads its level from {what}, and none is given here. "
                f"Give a measurement {where}, or use noise.Gaussian(sigma)."
            )
        deviation = data.deviation * jnp.asarray(self.factor)
        return _masked(Normal(predicted, jnp.sqrt(deviation**2 + kernel)), data)

    def deviation(self, data: Data) -> Response | None:
        """Return the known deviation times the factor; None where this is a distribution."""
        if is_unknown(self.factor) or data.deviation is None:
            return None
        return data.deviation * self.factor


class FromCoherence(_OfMeasurement):
    """Independent errors at each line, known from coherence and averages.

    E|error|^2 = |H|^2 (1 - coherence) / (averages coherence) for an FRF by the H1 estimator, half
    of it in the real part and half in the imaginary part (Bendat and Piersol, Random Data, ch. 9).
    A coherence that few averages estimate scatters itself: its neighbouring lines then tell the
    error (`Measurement.noise_variance`).

    Parameters
    ----------
    factor
        Factor on the standard deviation [1]: 1, or a distribution where the coherence does not
        contain all errors.

    Examples
    --------
    >>> bp.noise.FromCoherence(factor=dist.LogUniform(0.5, 5.0)).reads_coherence
    True
    """

    reads_coherence: ClassVar[bool] = True
    source: ClassVar[Words] = "the coherence and the averages of a measurement", "with both"


class FromVariance(_OfMeasurement):
    """Independent errors whose variance at each line comes with the measurement.

    The variance is E|error|^2 of a complex FRF, as the scatter of repeats shows it
    (`time_records.frf`); half of it is in the real and half in the imaginary part. Other than
    `FromCoherence` it holds for any estimator.

    Parameters
    ----------
    factor
        Factor on the standard deviation [1]: 1, or a distribution where repeats do not show all
        errors, as of a sensor that was not mounted anew.

    Examples
    --------
    >>> bp.noise.FromVariance(factor=1.5).reads_variance
    True
    """

    reads_variance: ClassVar[bool] = True
    source: ClassVar[Words] = "the variance that a measurement states", "of time_records.frf"

    def variance(self, measurement: Measurement) -> np.ndarray | None:
        """Variance E|error|^2 of each FRF value, as the measurement states it."""
        return measurement.stated_variance()


class FromScatter(_OfMeasurement):
    """Independent errors whose variance at each line is read from the scatter of its neighbours.

    For records without coherence. What a quotient of polynomials leaves of nine neighbouring lines
    is noise (`Measurement.scatter_variance`): of all that were recorded, also where few are chosen.

    Parameters
    ----------
    factor
        Factor on the standard deviation [1]: 1, or a distribution where lines do not show all
        errors.

    Examples
    --------
    >>> bp.noise.FromScatter().factor
    1.0
    """

    source: ClassVar[Words] = "the scatter of lines of a measurement", "of its whole record"

    def variance(self, measurement: Measurement) -> np.ndarray | None:
        """Variance E|error|^2 of each FRF value, as neighbouring lines show it."""
        return measurement.scatter_variance()


class Relative(Noise):
    """Independent errors in proportion to the measured amplitude, above a floor.

    E|error|^2 = (ratio |H|)^2 + floor^2 + (coherence factor)^2 E|error|^2 of the coherence, for an
    FRF H of the observed quantity; as by `FromCoherence`, half of it is in the real and half in the
    imaginary part. |H| is the measured amplitude, so that the noise does not depend on the
    parameters; in a simulation it is the predicted one. Bound an unknown ratio well below 1: near
    1 it would explain any scatter.

    Parameters
    ----------
    ratio
        Root mean square of |error| over |H| [1], a number or a distribution.
    floor
        Root mean square of |error| where H vanishes [unit of the FRF], a number or a distribution.
    coherence
        Factor on the standard deviation known from coherence and averages [1], a number or a
        distribution; None where the coherence is not read.

    Raises
    ------
    InputError
        For a ratio or factor that is not positive, or a negative floor.

    Examples
    --------
    >>> noise = bp.noise.Relative(dist.Uniform(0.001, 0.1), floor=1e-7)
    >>> noise.reads_amplitude, noise.reads_coherence
    (True, False)
    """

    reads_amplitude: ClassVar[bool] = True
    ratio: Parameter = eqx.field(metadata=unit("1", within=SHARE_OF_AMPLITUDE))
    floor: Parameter = eqx.field(metadata=unit("unit of the FRF"))
    coherence: Parameter | None = eqx.field(metadata=unit("1"))

    def __init__(
        self, ratio: Parameter, floor: Parameter = 0.0, *, coherence: Parameter | None = None
    ):
        self.ratio = positive("noise.Relative(ratio, floor)", "ratio", ratio)
        self.floor = not_negative("noise.Relative(ratio, floor)", "floor", floor)
        self.coherence = (
            None
            if coherence is None
            else positive("noise.Relative(ratio, coherence=)", "coherence factor", coherence)
        )

    @property
    def reads_coherence(self) -> bool:
        """Whether a factor on the level of the coherence is given."""
        return self.coherence is not None

    def distribution(
        self, predicted: Response, data: Data | None, kernel: float | Array = 0.0
    ) -> Distribution:
        """Independent normal distribution of every output."""
        deviation = self._deviation(data)
        return _masked(Normal(predicted, jnp.sqrt(deviation**2 + kernel)), data)

    def deviation(self, data: Data) -> Response | None:
        """Deviation of every output; None where a number of it is a distribution."""
        unknown = any(map(is_unknown, (self.ratio, self.floor, self.coherence)))
        return None if unknown else self._deviation(data)

    def _deviation(self, data: Data | None) -> Response:
        if data is None or data.relative is None or data.absolute is None:
            raise InputError(
                "noise.Relative reads its level from the amplitude of measured FRFs, and none is "
                "given here. Give the data of an experiment that has this noise, "
                "experiment.data(measurement), or use noise.Gaussian(sigma)."
            )
        ratio, floor = jnp.asarray(self.ratio), jnp.asarray(self.floor)
        variance = (data.relative * ratio) ** 2 + (data.absolute * floor) ** 2
        if self.coherence is None:
            return jnp.sqrt(variance)
        if data.deviation is None:
            raise InputError(
                "noise.Relative(coherence=) reads a part of its level from the coherence and the "
                "averages of a measurement, and none is given here. Give a measurement with both, "
                "or leave coherence out."
            )
        return jnp.sqrt(variance + (data.deviation * jnp.asarray(self.coherence)) ** 2)


def _channels(sigma: Array, sensors: Chosen, actuators: Chosen) -> Array:
    sigma = sigma[sensors] if sigma.shape[0] > 1 else sigma
    return sigma[:, actuators] if sigma.shape[1] > 1 else sigma


def _as_outputs(sigma: Parameter, predicted: Response) -> Array:
    level = jnp.asarray(sigma)
    if level.ndim == 3:  # common to all force levels and both parts of a complex FRF
        between = tuple(range(2, predicted.ndim - 1))
        level = jnp.expand_dims(level, between)
    try:
        return jnp.broadcast_to(level, predicted.shape)
    except ValueError as error:
        raise InputError(
            f"noise.Gaussian(sigma) was given a level of shape {np.shape(sigma)}, but the outputs "
            f"have the shape {predicted.shape}; a number, or an array that fits them is needed, "
            "since each output has one: noise.Gaussian(0.01)."
        ) from error


def _masked(distribution: Distribution, data: Data | None) -> Distribution:
    return distribution if data is None else distribution.mask(data.measured)
