"""What is observed of an FRF: the real outputs z, the data of a measurement, and their errors."""

import abc
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Inexact

from .._shared.compiled import compiled
from .._shared.dimensions import Receptance, Response
from .._shared.errors import InputError
from .._shared.reprs import with_short_repr
from ..positions.channel import Channel
from .quantities import quantity_of

if TYPE_CHECKING:  # the class imports this module
    from .experiment import Experiment

Chosen: TypeAlias = slice | np.ndarray
"""Some channels: a slice of them, or their numbers."""


class Data(eqx.Module):
    """Measured outputs, in the shape of the predicted ones."""

    z: Response
    """Measured outputs; zero where nothing was measured."""
    measured: Bool[Array | np.ndarray, "sensor actuator *level_and_part frequency"]
    """Where something was measured."""
    deviation: Response | None = None
    """Standard deviation of each output known from the measurement, or None."""
    relative: Response | None = None
    absolute: Response | None = None
    """Standard deviation of each output for E|error|^2 = |H|^2, |H| being the measured amplitude,
    and for E|error|^2 = 1; None where the noise does not need them."""
    scatter: Response | None = None
    """Standard deviation of each output by the scatter of neighbouring lines of the whole record;
    None where that tells none, or the noise is known."""

    def of(self, sensors: Chosen = slice(None), actuators: Chosen = slice(None)) -> "Data":
        """Return the data of some sensor and actuator channels."""

        def pick(values: Array | np.ndarray | None) -> Any:
            if values is None:
                return None
            # By NumPy where they are known: to pick by numbers would be compiled.
            known = values if isinstance(values, jax.core.Tracer) else np.asarray(values)
            return jnp.asarray(known[sensors][:, actuators])

        return Data(*(pick(getattr(self, name)) for name in _FIELDS))

    @staticmethod
    def at_levels(runs: "Sequence[Data]") -> "Data":
        """Return the data of several force levels, one run each, as one."""

        def stacked(values: list[Array | np.ndarray | None]) -> Any:
            xp = np if isinstance(values[0], np.ndarray) else jnp
            return None if any(each is None for each in values) else xp.stack(values, axis=2)

        return Data(*(stacked([getattr(run, name) for run in runs]) for name in _FIELDS))


_FIELDS = ("z", "measured", "deviation", "relative", "absolute", "scatter")


FRF = Inexact[Array, "sensor actuator *force_level frequency"]
Variance = Float[Array, "sensor actuator *force_level frequency"]
Record = Inexact[np.ndarray, "sensor actuator frequency"]
Finite = Bool[Array, "sensor actuator frequency"]
Measured = Float[np.ndarray, "sensor actuator *level_and_part frequency"]
AngularFrequencies = Float[np.ndarray, "frequency"]


@with_short_repr
class Observation(eqx.Module):
    """The mapping z = f(U) of Eq. (8), and the error of z by that of U.

    Attributes
    ----------
    reference_unit
        Unit of what `receptance` returns.
    is_modal
        Whether modal parameters are observed and no FRFs.

    Examples
    --------
    >>> isinstance(bp.observe.Complex("velocity"), bp.observe.Observation)
    True
    """

    quantity: eqx.AbstractVar[str]
    parts: eqx.AbstractClassVar[int]
    reference_unit: ClassVar[str] = "m/N"
    is_modal: ClassVar[bool] = False

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
    def receptance(self, measured: Measured, omega: AngularFrequencies) -> Measured:
        """Return the receptance [m/N], or its amplitude, by outputs of any observed quantity.

        Parameters
        ----------
        measured
            Outputs z; NaN where nothing was measured.
        omega
            Angular frequency of each line [rad/s].
        """

    @abc.abstractmethod
    def log_jacobian(self, measured: Measured, omega: AngularFrequencies) -> Measured:
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

    def check(self, frequency: Float[Array | np.ndarray, "frequency"]) -> None:
        """Refuse 0 Hz, where velocity and acceleration vanish and carry no information."""
        if self.quantity != "displacement" and np.any(frequency == 0):
            raise InputError(
                f"observe.{type(self).__name__} needs |U| > 0, but frequency 0 Hz gives zero "
                f"{self.quantity}. Drop 0 Hz: frequency[frequency > 0]."
            )

    def predicted(self, experiment: "Experiment") -> Response:
        """Outputs z of an experiment without output error."""
        return self.output(experiment.frf())

    def lines(self, frequency: object) -> object:
        """Return the lines [Hz] of an experiment for which these were given."""
        return frequency

    def on(self, channels: Sequence[Channel]) -> "Observation":
        """Return the observation of an experiment with these sensor channels."""
        return self

    def data(self, measurement: object) -> Data | None:
        """Return what was measured as data, where the observation itself holds it."""
        return None

    def own_data(self) -> Data | None:
        """Return what was measured, where the observation itself holds it."""
        return None

    def rows(self, channels: Sequence[Channel]) -> list[str]:
        """Names of the rows of the outputs: those of the sensor channels."""
        return [channel.label for channel in channels]

    def columns(self, channels: Sequence[Channel]) -> list[str]:
        """Names of the columns of the outputs: those of the actuator channels."""
        return [channel.label for channel in channels]


def measured_outputs(
    observe: Observation, frf: Record, variance: Record | None = None, *, amplitude: bool = False
) -> Data:
    """Turn measured FRFs into outputs.

    FRFs [sensor, actuator, frequency] and their variances E|error|^2 are NaN where nothing was
    measured; there are none where the level of the output error comes from elsewhere, which may
    depend on the amplitude.
    """
    measured = np.isfinite(frf)
    filled = np.where(measured, frf, 1.0)
    z, *deviations = compiled(_outputs)(observe, filled, measured, variance, amplitude)
    if observe.parts > 1:
        measured = np.broadcast_to(measured[..., None, :], z.shape)
    return Data(z, measured, *deviations)


def with_scatter(data: Data, observe: Observation, frf: Record, variance: Record | None) -> Data:
    """Return data with the scatter of lines, unless it is not known, or some do not scatter."""
    if variance is None or not np.all((variance > 0) | np.isnan(frf)):
        return data
    return replace(data, scatter=measured_outputs(observe, frf, variance).deviation)


def simulated_outputs(observe: Observation, frf: FRF) -> Data:
    """Turn predicted FRFs into the data of a measurement without error, all of it measured."""
    z = observe.output(frf)
    return Data(z, np.ones(z.shape, dtype=bool), None, *_unit_deviations(observe, frf))


def _outputs(
    observe: Observation, frf: FRF, measured: Finite, variance: Variance | None, amplitude: bool
) -> tuple[Response, Response | None, Response | None, Response | None]:
    """Outputs, zero where not measured, and their deviations; None where these are not known."""
    z = observe.output(frf)
    of_parts = measured[..., None, :] if observe.parts > 1 else measured
    deviation = None
    if variance is not None:
        # A level where nothing was measured is never used, but it must not be NaN in a gradient.
        deviation = observe.deviation(frf, jnp.where(jnp.isnan(variance), 1.0, variance))
    unit, constant = _unit_deviations(observe, frf) if amplitude else (None, None)
    return jnp.where(of_parts, z, 0.0), deviation, unit, constant


def _unit_deviations(observe: Observation, frf: FRF) -> tuple[Response, Response]:
    """Deviations of the outputs for E|error|^2 = |H|^2 and for E|error|^2 = 1."""
    square = jnp.abs(frf) ** 2
    return observe.deviation(frf, square), observe.deviation(frf, jnp.ones_like(square))
