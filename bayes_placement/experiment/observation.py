"""What an observation is: outputs z of an experiment, their errors, and what they determine."""

import abc
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float, Inexact

from .._shared.dimensions import Receptance, Response
from .._shared.errors import InputError
from .._shared.reprs import with_short_repr
from ..positions.channel import Channel
from ._data import Data
from .quantities import quantity_of

if TYPE_CHECKING:  # the class imports this module
    from .experiment import Experiment

FRF = Inexact[Array, "sensor actuator *force_level frequency"]
Variance = Float[Array, "sensor actuator *force_level frequency"]
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

    def check(self, frequency: np.ndarray) -> None:
        """Refuse 0 Hz, where velocity and acceleration vanish and carry no information."""
        if self.quantity != "displacement" and np.any(frequency == 0):
            raise InputError(
                f"observe.{type(self).__name__} needs |U| > 0, but frequency 0 Hz gives zero "
                f"{self.quantity}. Drop 0 Hz: frequency[frequency > 0]."
            )

    def predicted(self, experiment: "Experiment") -> Response:
        """Outputs z of an experiment without output error."""
        return self.output(experiment.frf())

    def lines(self, frequency: Any) -> Any:
        """Return the lines [Hz] of an experiment for which these were given."""
        return frequency

    def on(self, channels: Sequence[Channel]) -> "Observation":
        """Return the observation of an experiment with these sensor channels."""
        return self

    def data(self, measurement: Any) -> Data | None:
        """Return what was measured as data, where the observation itself holds it."""
        return None

    def stated(self) -> Data | None:
        """Return what was measured, where the observation itself holds it."""
        return None

    def rows(self, channels: Sequence[Channel]) -> list[str]:
        """Names of the rows of the outputs: those of the sensor channels."""
        return [channel.label for channel in channels]

    def columns(self, channels: Sequence[Channel]) -> list[str]:
        """Names of the columns of the outputs: those of the actuator channels."""
        return [channel.label for channel in channels]
