"""Observations: the real outputs z of an FRF or of modes, and the errors of these."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.polynomial import Chebyshev, Polynomial

from .._shared.dimensions import Response
from .observation import FRF, AngularFrequencies, Measured, Observation, Variance
from .observed_modes import ModalData
from .quantities import motion_name, quantity_of

__all__ = ["Complex", "LogAmplitude", "ModalData", "Observation"]


class LogAmplitude(Observation):
    """Decimal logarithm of the amplitude, z = log10 |U|, as in section 5 of the paper.

    Parameters
    ----------
    quantity
        `displacement`, `velocity` or `acceleration`, per unit force in SI; or the FRF,
        `receptance`, `mobility` or `accelerance`.

    Examples
    --------
    >>> bp.observe.LogAmplitude("accelerance").label
    'log10 of acceleration per force [(m/s²)/N]'
    """

    quantity: str = eqx.field(static=True, converter=motion_name)
    parts = 1

    def output(self, frf: FRF) -> Response:
        """log10 |U|, by the square of the modulus, which has the simpler gradient."""
        return 0.5 * log10(jnp.real(frf) ** 2 + jnp.imag(frf) ** 2)

    def deviation(self, frf: FRF, variance: Variance) -> Response:
        """First-order error of log10 |U|: only the part of the error along U counts."""
        return jnp.sqrt(variance / 2) / (jnp.abs(frf) * jnp.log(10.0))

    def relative(self, outputs: Measured) -> Measured:
        """Only the part of the error along U counts, half of the variance."""
        return np.full(outputs.shape, 1 / (np.sqrt(2) * np.log(10.0)))

    def receptance(self, measured: Measured, omega: AngularFrequencies) -> Measured:
        """Amplitude of the receptance |H| [m/N]; z does not contain the phase."""
        return 10.0**measured / omega**self.derivative

    def log_jacobian(self, measured: Measured, omega: AngularFrequencies) -> Measured:
        """Log of dz / d|H| = 1 / (|H| log 10)."""
        return -np.log(self.receptance(measured, omega) * np.log(10.0))

    @property
    def label(self) -> str:
        """Axis label."""
        return f"log10 of {self.quantity} per force [{quantity_of(self.quantity).unit}]"


class Complex(Observation):
    """Real and imaginary part of the FRF, on an axis `part` of two before frequency.

    Parameters
    ----------
    quantity
        `displacement`, `velocity` or `acceleration`, per unit force in SI; or the FRF,
        `receptance`, `mobility` or `accelerance`.

    Examples
    --------
    >>> bp.observe.Complex("velocity").label, bp.observe.Complex("velocity").parts
    ('velocity per force [(m/s)/N]', 2)
    """

    quantity: str = eqx.field(static=True, converter=motion_name)
    parts = 2

    def output(self, frf: FRF) -> Response:
        """Real and imaginary part."""
        return jnp.stack([jnp.real(frf), jnp.imag(frf)], axis=-2)

    def deviation(self, frf: FRF, variance: Variance) -> Response:
        """Half of the variance lies in each part of a circular error."""
        return jnp.sqrt(jnp.stack([variance, variance], axis=-2) / 2)

    def relative(self, outputs: Measured) -> Measured:
        """Half of the variance |U|^2 lies in each part."""
        squares = np.sum(np.asarray(outputs) ** 2, axis=-2, keepdims=True)
        return np.broadcast_to(np.sqrt(squares / 2), outputs.shape)

    def receptance(self, measured: Measured, omega: AngularFrequencies) -> Measured:
        """Real and imaginary part of the receptance [m/N]."""
        frf = measured[..., 0, :] + 1j * measured[..., 1, :]
        receptance = frf / (1j * omega) ** self.derivative
        return np.stack([np.real(receptance), np.imag(receptance)], axis=-2)

    def log_jacobian(self, measured: Measured, omega: AngularFrequencies) -> Measured:
        """Log of the factor omega^n on both parts; the rotation by i^n changes no volume."""
        return np.log(omega**self.derivative) + 0.0 * measured

    @property
    def label(self) -> str:
        """Axis label."""
        return f"{self.quantity} per force [{quantity_of(self.quantity).unit}]"


DEGREE = 8
"""Degree of the polynomial, by which the result is right within three units of rounding."""

MANTISSA_BITS = 23
_HALF_OCTAVE = np.sqrt(0.5).astype(np.float32).view(np.int32)
_EXPONENT = np.int32(-(1 << MANTISSA_BITS))
_TINY = np.finfo(np.float32).tiny


def log10(value: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Decimal logarithm of positive numbers; minus infinity of zero and, if single, next to it."""
    return _log10_of_single(value) if value.dtype == jnp.float32 else jnp.log10(value)


@jax.custom_jvp
def _log10_of_single(value: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """In less than half of the time that the compiler takes: maps of information are made of it."""
    bits = jax.lax.bitcast_convert_type(value, jnp.int32)
    # The number is 2^n (1 + t), t about zero: n in the upper bits is taken away.
    exponent = (bits - _HALF_OCTAVE) & _EXPONENT
    beyond_one = jax.lax.bitcast_convert_type(bits - exponent, jnp.float32) - 1
    series = jnp.full_like(beyond_one, _SERIES[-1])
    for term in _SERIES[-2::-1]:
        series = series * beyond_one + term
    octaves = exponent.astype(jnp.float32) * np.float32(np.log10(2) / 2**MANTISSA_BITS)
    result = beyond_one * series + octaves
    positive = jnp.where(value >= _TINY, result, -jnp.inf)
    return jnp.where(value < jnp.inf, positive, value)  # infinite, or NaN


@_log10_of_single.defjvp
def _slope(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
    (value,), (change,) = primals, tangents
    return _log10_of_single(value), change / (value * np.float32(np.log(10)))


def _series() -> Float[np.ndarray, "term"]:
    """Polynomial for log10(1 + t) / t, from the root of 1/2 to that of 2."""
    interval = [np.sqrt(0.5) - 1, np.sqrt(2.0) - 1]
    ratio = Chebyshev.interpolate(lambda t: np.log1p(t) / (t * np.log(10)), DEGREE, interval)
    return ratio.convert(kind=Polynomial).coef.astype(np.float32)


_SERIES = _series()
