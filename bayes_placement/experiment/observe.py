"""Observations: the real outputs z of an FRF, their errors, and the receptance they determine."""

import abc

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact

from .._types import InputError, Receptance, Response
from .quantities import motion_name, quantity_of

FRF = Inexact[Array, "sensor actuator *force_level frequency"]
Variance = Float[Array, "sensor actuator *force_level frequency"]
Measured = Float[np.ndarray, "sensor actuator *level_and_part frequency"]
Lines = Float[np.ndarray, "frequency"]


class Observation(eqx.Module):
    """The mapping z = f(U) of Eq. (8), and the error of z by that of U.

    Examples
    --------
    >>> isinstance(bp.observe.Complex("velocity"), bp.observe.Observation)
    True
    """

    quantity: eqx.AbstractVar[str]
    parts: eqx.AbstractClassVar[int]

    @abc.abstractmethod
    def output(self, frf: FRF) -> Response:
        """Outputs z of an FRF of the observed quantity."""

    @abc.abstractmethod
    def deviation(self, frf: FRF, variance: Variance) -> Response:
        """Standard deviation of each output, given E|error|^2 of the FRF."""

    @abc.abstractmethod
    def relative(self, outputs: Measured) -> Measured:
        """Standard deviation of each output for an FRF with a relative error of 1."""

    @abc.abstractmethod
    def receptance(self, measured: Measured, omega: Lines) -> Measured:
        """Return the receptance [m/N], or its amplitude, by outputs of any observed quantity.

        Parameters
        ----------
        measured
            Outputs z; NaN where nothing was measured.
        omega
            Angular frequency of each line [rad/s].
        """

    @abc.abstractmethod
    def log_jacobian(self, measured: Measured, omega: Lines) -> Measured:
        """Log of |dz / d r| for each output, with r as `receptance` returns it.

        The density of z times this Jacobian is a density of the receptance, in which models of
        different observed quantities are comparable.

        Parameters
        ----------
        measured
            Outputs z; NaN where nothing was measured.
        omega
            Angular frequency of each line [rad/s].
        """

    @property
    @abc.abstractmethod
    def label(self) -> str:
        """Name and unit of the outputs for an axis."""

    def frf(self, receptance: Receptance, omega: Inexact[Array, "frequency"]) -> Receptance:
        """Turn a receptance into the FRF of the observed quantity."""
        return receptance * (1j * omega) ** self.derivative

    @property
    def derivative(self) -> int:
        """Order of the time derivative of the displacement that is observed."""
        return quantity_of(self.quantity).derivative

    def check(self, frequency: np.ndarray) -> None:
        """Refuse 0 Hz, where velocity and acceleration vanish and carry no information."""
        if self.quantity != "displacement" and np.any(frequency == 0):
            raise InputError(
                f"observe.{type(self).__name__} needs |U| > 0, but frequency 0 Hz gives zero "
                f"{self.quantity}. Drop 0 Hz: frequency[frequency > 0]."
            )


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
        return 0.5 * jnp.log10(jnp.real(frf) ** 2 + jnp.imag(frf) ** 2)

    def deviation(self, frf: FRF, variance: Variance) -> Response:
        """First-order error of log10 |U|: only the part of the error along U counts."""
        return jnp.sqrt(variance / 2) / (jnp.abs(frf) * jnp.log(10.0))

    def relative(self, outputs: Measured) -> Measured:
        """Only the part of the error along U counts, half of the variance."""
        return np.full(outputs.shape, 1 / (np.sqrt(2) * np.log(10.0)))

    def receptance(self, measured: Measured, omega: Lines) -> Measured:
        """Amplitude of the receptance |H| [m/N]; z does not contain the phase."""
        return 10.0**measured / omega**self.derivative

    def log_jacobian(self, measured: Measured, omega: Lines) -> Measured:
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

    def receptance(self, measured: Measured, omega: Lines) -> Measured:
        """Real and imaginary part of the receptance [m/N]."""
        frf = measured[..., 0, :] + 1j * measured[..., 1, :]
        receptance = frf / (1j * omega) ** self.derivative
        return np.stack([np.real(receptance), np.imag(receptance)], axis=-2)

    def log_jacobian(self, measured: Measured, omega: Lines) -> Measured:
        """Log of the factor omega^n on both parts; the rotation by i^n changes no volume."""
        return np.log(omega**self.derivative) + 0.0 * measured

    @property
    def label(self) -> str:
        """Axis label."""
        return f"{self.quantity} per force [{quantity_of(self.quantity).unit}]"
