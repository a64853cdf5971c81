"""observe: in, an FRF of displacement, velocity or acceleration; out, the real outputs z.

Not known here: the structure, priors, the noise level.
"""

import abc

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact

from ._types import Receptance, Response

_DERIVATIVE = {"displacement": 0, "velocity": 1, "acceleration": 2}
_UNIT = {"displacement": "m/N", "velocity": "(m/s)/N", "acceleration": "(m/s²)/N"}
FRF_OF = {"displacement": "receptance", "velocity": "mobility", "acceleration": "accelerance"}

FRF = Inexact[Array, "sensor actuator frequency"]
Variance = Float[Array, "sensor actuator frequency"]


def _known(quantity: str) -> str:
    if quantity not in _DERIVATIVE:
        raise ValueError(
            f"The quantity {quantity!r} cannot be observed. "
            "Give displacement, velocity or acceleration: observe.LogAmplitude('velocity')."
        )
    return quantity


class Observation(eqx.Module):
    """The mapping z = f(U) of Eq. (8), with what it does to errors."""

    quantity: eqx.AbstractVar[str]
    parts: eqx.AbstractClassVar[int]

    @abc.abstractmethod
    def output(self, frf: FRF) -> Response:
        """Outputs z of an FRF of the observed quantity."""

    @abc.abstractmethod
    def deviation(self, frf: FRF, variance: Variance) -> Response:
        """Standard deviation of each output, given E|error|^2 of the FRF."""

    @abc.abstractmethod
    def log_jacobian(self, frf: FRF) -> Float[Array, ""]:
        """Log |dz / d(FRF)|, which makes densities of different outputs comparable."""

    @property
    @abc.abstractmethod
    def label(self) -> str:
        """Name and unit of the outputs for an axis."""

    def frf(self, receptance: Receptance, omega: Float[Array, "frequency"]) -> Receptance:
        """Turn a receptance into the FRF of the observed quantity."""
        return receptance * (1j * omega) ** _DERIVATIVE[self.quantity]

    def check(self, frequency: np.ndarray) -> None:
        """Refuse 0 Hz, where velocity and acceleration vanish and carry no information."""
        if self.quantity != "displacement" and np.any(frequency == 0):
            raise ValueError(
                f"observe.{type(self).__name__} needs |U| > 0, but frequency 0 Hz gives zero "
                f"{self.quantity}. Drop 0 Hz: frequency[frequency > 0]."
            )


class LogAmplitude(Observation):
    """Decimal logarithm of the amplitude, z = log10 |U|, as in section 5 of the paper.

    Parameters
    ----------
    quantity
        `displacement`, `velocity` or `acceleration`, per unit force in SI.
    """

    quantity: str = eqx.field(static=True, converter=_known)
    parts = 1

    def output(self, frf: FRF) -> Response:
        """log10 |U|, by the square of the modulus, whose gradient is the simpler."""
        return 0.5 * jnp.log10(jnp.real(frf) ** 2 + jnp.imag(frf) ** 2)

    def deviation(self, frf: FRF, variance: Variance) -> Response:
        """First-order error of log10 |U|: only the part of the error along U counts."""
        return jnp.sqrt(variance / 2) / (jnp.abs(frf) * jnp.log(10.0))

    def log_jacobian(self, frf: FRF) -> Float[Array, ""]:
        """Log |dz / d|U||, summed over the data; the phase is in neither description."""
        return -jnp.sum(jnp.log(jnp.abs(frf) * jnp.log(10.0)))

    @property
    def label(self) -> str:
        """Axis label."""
        return f"log10 of {self.quantity} per force [{_UNIT[self.quantity]}]"


class Complex(Observation):
    """Real and imaginary part of the FRF, on an axis `part` of two before frequency.

    Parameters
    ----------
    quantity
        `displacement`, `velocity` or `acceleration`, per unit force in SI.
    """

    quantity: str = eqx.field(static=True, converter=_known)
    parts = 2

    def output(self, frf: FRF) -> Response:
        """Real and imaginary part."""
        return jnp.stack([jnp.real(frf), jnp.imag(frf)], axis=-2)

    def deviation(self, frf: FRF, variance: Variance) -> Response:
        """Half of the variance lies in each part of a circular error."""
        return jnp.sqrt(jnp.stack([variance, variance], axis=-2) / 2)

    def log_jacobian(self, frf: FRF) -> Float[Array, ""]:
        """Zero: the outputs are the FRF itself."""
        return jnp.zeros(())

    @property
    def label(self) -> str:
        """Axis label."""
        return f"{self.quantity} per force [{_UNIT[self.quantity]}]"
