"""The observation of modal parameters: natural frequencies, damping ratios and mode shapes."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Inexact, Int

from .._shared.arguments import check_kind
from .._shared.dimensions import Receptance, Response, Shapes
from .._shared.errors import InputError
from ..positions.channel import Channel
from ._experiment_checks import all_known, no_frfs
from ._oscillator import Branches, MeasuredShapes, Oscillator, assurance, paired
from .modal_parameters import DAMPING, FREQUENCY, SHAPE, ModalParameters
from .observation import FRF, AngularFrequencies, Data, Measured, Observation, Variance

if TYPE_CHECKING:  # the class imports this module
    from .experiment import Experiment

COLUMN = "modes"
"""Name of the only column of the outputs."""

ROWS = ("natural frequency", "damping ratio")
"""Names of the rows before those of the shapes."""


class ModesOfModel(NamedTuple):
    """Modes of a model, paired with measured ones."""

    values: Float[Array, "row mode"]
    """Natural frequency [Hz], damping ratio [1] and shape at the sensor channels, in any scale."""
    number: Int[Array, "mode"]
    """Number of each among the elastic modes of the model, from 1."""
    assurance: Float[Array, "mode elastic"]
    """Modal assurance criterion [1] of each measured mode with every elastic mode of the model; 0
    without shapes."""


class ModalData(Observation):
    """Natural frequencies [Hz], damping ratios [1] and shapes of measured modes.

    Each measured mode is compared with the mode of the model that has its number, or else with the
    one whose shape (by the modal assurance criterion, Allemang 2003, within the uncertainty of the
    measured shape) and natural frequency are nearest, each mode once. The outputs are laid out as
    rows (natural frequency, damping ratio, sensor channels) by measured modes, which stand where
    lines do. The scale of a shape means nothing: it is eliminated by least squares, which costs
    one datum of each shape. That of the channel most certain is taken, and what is left is turned
    so that the errors of all others remain independent: the residual of a channel is its error
    over its deviation, as far as the scale leaves it. Errors that a covariance correlates are made
    independent by the inverse root of their correlation, and so are those of natural frequencies
    that are correlated between modes.

    Poles are those of the damped structure with all that is attached, the sensors included, which
    are taken for mounted all the time. No actuator is needed or known.

    Parameters
    ----------
    measured
        What was measured.

    Raises
    ------
    InputError
        If something else is given, or neither shapes at two channels nor numbers tell which modes
        were measured.

    Examples
    --------
    >>> modes = bp.ModalParameters([160.0, 330.0], [0.1, 0.2], number=[1, 2])
    >>> bp.Experiment(
    ...     structure,
    ...     sensors=[],
    ...     observe=bp.observe.ModalData(modes),
    ...     noise=bp.noise.FromVariance(),
    ... )
    Experiment: 2 modes from 160 to 330 Hz, shapes at 0 sensor channels, z = natural frequency [Hz],
    damping ratio [1], shape [as measured]
    """

    parts: ClassVar[int] = 1
    reference_unit: ClassVar[str] = "as observed"
    is_modal: ClassVar[bool] = True
    quantity: str = eqx.field(static=True)
    values: Float[np.ndarray, "row mode"]
    errors: Float[np.ndarray, "mode row row"]
    root: Float[np.ndarray, "mode row row"] = eqx.field(repr=False)
    correlation: Float[np.ndarray, "mode mode"] = eqx.field(repr=False)
    root_between: Float[np.ndarray, "mode mode"] = eqx.field(repr=False)
    present: Bool[np.ndarray, "row mode"] = eqx.field(repr=False)
    reference: Int[np.ndarray, "mode"] = eqx.field(repr=False)
    number: tuple[int, ...] | None = eqx.field(static=True)
    channels: tuple[Channel, ...] = eqx.field(static=True)

    def __init__(self, measured: ModalParameters):
        check_kind(
            "measured",
            measured,
            ModalParameters,
            "modal parameters are needed, since the model's modes are paired with them",
            "observe=observe.ModalData(bp.ModalParameters(frequency, deviation, number=[1, 2]))",
        )
        self.quantity = COLUMN
        self.present = np.isfinite(measured.values)
        self.values = np.where(self.present, measured.values, 0.0)
        self.errors = measured.covariance
        self.root = _inverse_roots(measured.covariance)
        self.correlation = measured.correlation
        (self.root_between,) = _inverse_roots(measured.correlation[None])
        self.reference = _references(measured)
        self.number = measured.number
        self.channels = measured.sensors
        _check_identity(self)

    def lines(self, frequency: object) -> Float[Array | np.ndarray, "mode"]:
        """Return the measured natural frequencies [Hz], which stand where lines do.

        Raises
        ------
        InputError
            If others were given.
        """
        if frequency is not None:
            raise InputError(
                "frequency= was given with observe.ModalData; nothing is needed, since modal "
                "parameters have no lines. Leave frequency out."
            )
        return self.values[FREQUENCY]

    def on(self, channels: Sequence[Channel]) -> "ModalData":
        """Return the observation with the rows of these sensor channels, in their order."""
        measured = self._as_measured()
        return ModalData(measured.channels(channels) if channels else measured.without_shapes())

    def _as_measured(self) -> ModalParameters:
        values = np.where(self.present, self.values, np.nan)
        return ModalParameters(
            values[FREQUENCY],
            damping_ratio=values[DAMPING],
            shape=values[SHAPE:] if self.channels else None,
            sensors=self.channels,
            covariance=self.errors,
            correlation=self.correlation,
            number=self.number,
        )

    def data(self, measurement: Any) -> Data:
        """Return what was measured as data.

        Raises
        ------
        InputError
            If it is not what the observation was made of.
        """
        needed = "modal parameters are needed, since observe.ModalData compares these"
        instead = "bp.infer(experiment, modes) with observe=observe.ModalData(modes)"
        check_kind("measurement", measurement, ModalParameters, needed, instead)
        observed = ModalData(measurement).on(self.channels)
        same = ("values", "errors", "correlation", "present", "number")
        if not all(np.array_equal(getattr(self, name), getattr(observed, name)) for name in same):
            raise InputError(
                "Other modal parameters were given than those of observe.ModalData; the same are "
                "needed, since the modes of the model are paired with them. Declare an experiment "
                "for each set: observe=observe.ModalData(measured)."
            )
        return self.own_data()

    def own_data(self) -> Data:
        """Return what was measured, in the layout of the outputs."""
        rows = np.arange(len(self.values))[:, None]
        counted = self.present & (rows != self.reference)
        return Data(jnp.asarray(self.values)[:, None], counted[:, None], self._sigma()[:, None])

    def rows(self, channels: Sequence[Channel]) -> list[str]:
        """Names of the rows: natural frequency, damping ratio, sensor channels."""
        return [*ROWS, *(channel.label for channel in channels)]

    def columns(self, channels: Sequence[Channel]) -> list[str]:
        """Name of the only column."""
        return [COLUMN]

    def predicted(self, experiment: "Experiment") -> Response:
        """Outputs of an experiment without output error: see the class."""
        modal, _, _ = self._modal(self._oscillator(experiment))
        axes = (1, 1, 1, 1, 0, 0)
        parts = (modal, self.values, self._sigma(), self.present, self.root, self.reference)
        independent = jax.vmap(_independent, axes, 1)(*map(jnp.asarray, parts))
        between = jnp.asarray(self.root_between) @ independent[FREQUENCY]
        independent = independent.at[FREQUENCY].set(between)
        return (jnp.asarray(self.values) - jnp.asarray(self._sigma()) * independent)[:, None]

    def of_model(self, experiment: "Experiment") -> ModesOfModel:
        """Modes of an experiment that are paired with the measured ones, and how alike shapes are.

        Parameters
        ----------
        experiment
            The experiment, nothing of which is unknown but its noise.
        """
        oscillator = self._oscillator(experiment)
        rigid = oscillator.modes.rigid_body_modes
        values, chosen, branches = self._modal(oscillator)
        criterion = jnp.zeros(branches.omega[:, rigid:].shape)
        if self.channels:
            shapes = _shapes(oscillator, branches.omega[0], rigid)
            criterion, _ = jax.vmap(assurance, (0, None))(self._measured_shapes(), shapes)
        return ModesOfModel(values, chosen - rigid + 1, criterion)

    def _oscillator(self, experiment: "Experiment") -> Oscillator:
        all_known(experiment)
        effects = [effect for _, effect in sorted(experiment.instrument_effects.items())]
        return Oscillator.of(
            experiment.structure, experiment.instruments, effects, experiment.model_error
        )

    def _modal(self, oscillator: Oscillator) -> tuple[Array, Array, Branches]:
        """Rows of the modes that are paired with the measured ones, which they are, and of all."""
        omega = self._omega()
        branches = jax.vmap(oscillator.branches)(omega)
        chosen = self._paired(oscillator, branches)
        pick = jax.vmap(lambda values, place: values[..., place])
        pole, vector = jax.vmap(oscillator.pole)(*(pick(part, chosen) for part in branches))
        natural = jnp.abs(pole)
        modal = jnp.stack([natural / (2 * jnp.pi), jnp.imag(pole) / natural])
        if self.channels:
            shape = oscillator.read(vector.T, natural)
            modal = jnp.concatenate([modal, _turned(shape, self.present[SHAPE:])])
        return modal, chosen, branches

    def _omega(self) -> Array:
        return 2 * jnp.pi * jnp.asarray(self.values[FREQUENCY])

    def _sigma(self) -> Array:
        return jnp.sqrt(jnp.diagonal(jnp.asarray(self.errors), axis1=1, axis2=2)).T

    def _paired(self, oscillator: Oscillator, branches: Branches) -> Array:
        """Branch of each measured mode."""
        rigid = oscillator.modes.rigid_body_modes
        _check_count(self, branches.omega.shape[1] - rigid)
        if self.number is not None:
            return jnp.asarray(self.number) + rigid - 1
        shapes = jax.vmap(oscillator.read)(branches.vector, branches.omega)
        return paired(self._measured_shapes(), branches.omega, jax.lax.stop_gradient(shapes))

    def _measured_shapes(self) -> MeasuredShapes:
        present = jnp.asarray(self.present)[SHAPE:]
        return MeasuredShapes(
            self._omega(),
            jnp.where(present, jnp.asarray(self.values)[SHAPE:], 0.0).T,
            jnp.where(present, self._sigma()[SHAPE:], 0.0).T,
            present.T,
        )

    def relative(self, outputs: Measured) -> Measured:
        """Size of each output."""
        return np.abs(outputs)

    def output(self, frf: FRF) -> Response:
        """Refused: an FRF has no modal parameters without a fit."""
        return no_frfs("An FRF was to be compared")

    def deviation(self, frf: FRF, variance: Variance) -> Response:
        """Refused, as `output`."""
        return no_frfs("The error of an FRF was asked for")

    def frf(self, receptance: Receptance, omega: object) -> Receptance:
        """Refused, as `output`."""
        return no_frfs("An FRF was asked for")

    def receptance(self, measured: Measured, omega: AngularFrequencies) -> Measured:
        """Return the outputs: no receptance follows from them."""
        return measured

    def log_jacobian(self, measured: Measured, omega: AngularFrequencies) -> Measured:
        """Zero: the outputs are what densities are compared of."""
        return 0.0 * measured

    def check(self, frequency: Float[Array | np.ndarray, "mode"]) -> None:
        """Modal parameters have no lines to be refused."""

    @property
    def label(self) -> str:
        """Axis label."""
        return "natural frequency [Hz], damping ratio [1], shape [as measured]"


def _shapes(oscillator: Oscillator, omega: Array, rigid: int) -> Array:
    """Shapes [channel, elastic] of all modes, each from an estimate of its own frequency."""

    def shape(omega: Array, number: Array) -> Array:
        near = oscillator.branches(omega)
        pole, vector = oscillator.pole(near.omega[number], near.vector[:, number])
        return oscillator.read(vector[:, None], jnp.abs(pole)[None])[:, 0]

    return jax.vmap(shape, out_axes=1)(omega[rigid:], jnp.arange(rigid, omega.size))


def _independent(
    modal: Array, values: Array, sigma: Array, present: Array, root: Array, reference: Array
) -> Float[Array, "row"]:
    """Errors of one mode over their deviations, of which the scale of the shape is eliminated.

    With e the errors over their deviations, made independent, and b the shape the same way, the
    scale of least squares leaves r = e - a a'e, a = b / |b|. The turn in the plane of a and the
    axis of the reference channel that carries a onto this axis leaves nothing there.
    """
    is_shape = jnp.arange(values.size) >= SHAPE

    def independent(rows: Array) -> Array:
        return root @ jnp.where(present, rows / sigma, 0.0)

    error = independent(values - jnp.where(is_shape, 0.0, modal))
    shape = independent(jnp.where(is_shape, modal, 0.0))
    square = shape @ shape
    unit = shape / jnp.sqrt(jnp.where(square > 0, square, 1.0))
    at_reference = jnp.arange(values.size) == reference
    unit = unit * jnp.where(jnp.sum(unit * at_reference) < 0, -1.0, 1.0)
    residual = error - unit * (unit @ error)
    share = jnp.sum(residual * at_reference) / (1 + jnp.sum(unit * at_reference))
    return jnp.where(at_reference, 0.0, residual - unit * share)


def _turned(shape: Inexact[Array, "channel mode"], present: Array | np.ndarray) -> Shapes:
    """Real part of complex shapes, each turned by the angle that makes most of it real."""
    squares = jnp.sum(jnp.where(present, shape, 0.0) ** 2, axis=0)
    size = jnp.abs(squares)
    is_positive = size > 0
    phase = jnp.sqrt(jnp.where(is_positive, squares / jnp.where(is_positive, size, 1.0), 1.0))
    return jnp.real(shape * jnp.conj(phase))


def _inverse_roots(covariance: np.ndarray) -> np.ndarray:
    """Inverse roots [mode, row, row] of the correlation: symmetric, so that rows keep meaning."""
    deviation = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    correlation = covariance / (deviation[:, :, None] * deviation[:, None])
    values, vectors = np.linalg.eigh(correlation)
    return np.einsum("kij,kj,klj->kil", vectors, values**-0.5, vectors)


def _references(measured: ModalParameters) -> np.ndarray:
    """Row of the most certain channel of each shape; -1 where there is none."""
    certain = np.nan_to_num(np.abs(measured.shape) / measured.deviation[SHAPE:], nan=-1.0)
    if not len(certain):
        return np.full(measured.natural_frequency.size, -1)
    return np.where(certain.max(axis=0) >= 0, certain.argmax(axis=0) + SHAPE, -1)


def _check_identity(modes: ModalData) -> None:
    compared = np.sum(modes.present[SHAPE:], axis=0)
    if modes.number is None and np.any(compared < 2):
        mode = int(np.argmax(compared < 2)) + 1
        raise InputError(
            f"Mode {mode} has a shape at {compared[mode - 1]} channels and no number; two channels "
            "are needed, or the numbers of all modes, since a frequency alone does not tell which "
            "mode of the model was measured: ModalParameters(..., number=[1, 2, 3])."
        )


def _check_count(modes: ModalData, elastic: int) -> None:
    needed = modes.values.shape[1]
    greatest = needed if modes.number is None else max(modes.number)
    if greatest > elastic:
        raise InputError(
            f"{needed} modes were measured, the greatest number being {greatest}, but the model "
            f"has {elastic} elastic modes; as many are needed, since each is paired with one. Give "
            "the model more: beams.bar(40, ...), or keep fewer: measured.modes(range(3))."
        )
