"""One NumPyro model of a structure, its instruments, the lines and what is observed."""

from collections import OrderedDict
from collections.abc import Mapping, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro
from jaxtyping import Array, Float

from .._shared.arguments import check_annotated
from .._shared.compiled import compiled
from .._shared.dimensions import Receptance, Response
from .._shared.errors import InputError
from .._shared.reprs import noun_html
from .._shared.sites import Owner, Role, Unknown, is_unknown, owners, realise, unknowns
from ..effects.effect import Effect
from ..effects.instrument_effect import InstrumentEffect
from ..effects.instruments import Instruments
from ..effects.scales import Scales
from ..positions.places import typical
from . import _experiment_checks
from ._experiment_checks import at_levels
from ._measurement_words import prior_table, sentence_on
from ._value_checks import check_values, fixed
from .data_checks import DataChecks, check_data
from .measurement import Channel, Measurement
from .modal_parameters import ModalParameters
from .model_error import Embedded, ModalErrors
from .noise import Data, Noise
from .observation import Observation, measured_outputs, simulated_outputs, with_scatter
from .recording import Drive, recorded, recorded_frequency
from .structure import Structure, added, check_free, is_dict
from .transducers import Actuator, Sensor, Transducer

MEASURED = "measured"
"""Name of the observed site."""

RESPONSE = "response"
"""Name of the outputs without output error, in simulations."""

Measurements = Measurement | ModalParameters | Sequence[Measurement]


class Experiment(eqx.Module):
    """A structure, its sensors and actuators with what is known of them, and what is measured.

    Every leaf that is a `numpyro.distributions.Distribution` is an unknown, and its path is its
    name: unknowns below `structure` are the parameters h, below `sensor` and `actuator` the
    placement, below `noise` the output error. `Experiment.model` is an ordinary NumPyro model.

    Parameters
    ----------
    structure
        The structure.
    sensors, actuators
        Sensors and actuators; every sensor is measured for every actuator.
    frequency
        Lines [Hz]; none where modes are observed.
    observe
        What is compared: `observe.LogAmplitude`, `observe.Complex`, or `observe.ModalData`, which
        needs neither actuators nor lines.
    noise
        Output error; None for the paper's case of no output error.
    force_levels
        Amplitudes of the force [N], each measured once; needed where the structure is nonlinear.
    model_error
        By how much the modes and channels differ from the model, `model_error.Embedded()`; None
        where the model is exact.
    sensors_mounted
        `roving`, each sensor alone in its run, or `fixed`, all mounted all the time, as where
        modes are observed.

    Raises
    ------
    ValueError
        For transducers of the same name or outside the structure, and for lines at which the
        observation is not finite.

    Examples
    --------
    >>> experiment = bp.Experiment(structure, **setup)
    >>> list(experiment.unknown)
    ['structure.damping.ratio', 'sensor.s1.position']
    >>> experiment.nominal().unknowns
    []
    """

    structure: Structure = eqx.field(metadata=owners(Role.PARAMETER))
    sensor: OrderedDict[str, Sensor] = eqx.field(metadata=owners(Role.PLACEMENT))
    actuator: OrderedDict[str, Actuator] = eqx.field(metadata=owners(Role.PLACEMENT))
    frequency: Float[Array | np.ndarray, "frequency"]
    observe: Observation
    noise: Noise | None = eqx.field(metadata=owners(Role.OUTPUT_ERROR))
    instrument_effects: OrderedDict[str, InstrumentEffect] = eqx.field(
        metadata=owners(Role.PARAMETER)
    )
    model_error: ModalErrors | None = eqx.field(metadata=owners(Role.MODEL_ERROR))
    force_levels: tuple[float, ...] | None = eqx.field(static=True)
    sensors_mounted: str = eqx.field(static=True)

    def __init__(
        self,
        structure: Structure,
        *,
        sensors: Sequence[Sensor],
        actuators: Sequence[Actuator] = (),
        frequency: object = None,
        observe: Observation,
        noise: Noise | None,
        model_error: Embedded | None = None,
        force_levels: Sequence[float] | None = None,
        sensors_mounted: str = "roving",
    ):
        _experiment_checks.kinds(structure, sensors, actuators, observe, noise)
        self.structure = structure
        least = _experiment_checks.least_transducers(observe, actuators, noise, force_levels)
        self.sensor = _experiment_checks.by_name(sensors, structure.modes, least)
        self.actuator = _experiment_checks.by_name(actuators, structure.modes, least)
        self.frequency = _experiment_checks.lines(observe.lines(frequency))
        _experiment_checks.lines_of_structure(structure, self.frequency, observe)
        self.observe = observe.on(self.sensor_channels)
        self.noise = noise
        self.instrument_effects = OrderedDict()
        self.force_levels = _experiment_checks.levels(force_levels)
        self.sensors_mounted = _experiment_checks.mounting(sensors_mounted, observe)
        observe.check(self.frequency)
        self.model_error = None
        check_values(self)
        if model_error is not None:
            self.model_error = self.with_model_error(model_error).model_error

    def __add__(self, effect: Effect) -> "Experiment":
        """Return the experiment with one more effect, on its structure or its instruments.

        Raises
        ------
        ValueError
            If its name is taken, it lies outside the structure or names no sensor.
        """
        _experiment_checks.seen(effect, self.observe)
        if isinstance(effect, InstrumentEffect):
            check_free(effect, self.structure.effects)
            numbered = effect.numbered(self.instruments)
            effects = added(self.instrument_effects, numbered.on(self.structure.modes))
            changed = eqx.tree_at(
                lambda tree: tree.instrument_effects, self, effects, is_leaf=is_dict
            )
            check_values(changed)
            return changed
        structure = self.structure + effect
        check_free(effect, self.instrument_effects)
        return self._with_structure(structure)

    @property
    def instruments(self) -> Instruments:
        """Sensors and actuators by name."""
        return Instruments(self.sensor, self.actuator)

    @property
    def effects(self) -> list[Effect]:
        """Every effect on the structure and the instruments."""
        return [*self.structure.effects.values(), *self.instrument_effects.values()]

    def with_model_error(self, model_error: Embedded | None) -> "Experiment":
        """Return the experiment with another model error, or with none."""
        check_annotated("model_error", model_error, Embedded | None)
        return self.with_errors(None if model_error is None else model_error.on(Scales(self)))

    def _with_structure(self, structure: Structure) -> "Experiment":
        _experiment_checks.lines_of_structure(structure, self.frequency, self.observe)
        changed = eqx.tree_at(lambda tree: tree.structure, self, structure)
        return changed if self.model_error is None else changed.with_errors(self.model_error)

    def with_errors(self, errors: ModalErrors | None) -> "Experiment":
        """Return the experiment with the errors of its own modes and channels, or with none."""
        ports = self.structure.uncertain_ports()
        return eqx.tree_at(
            lambda tree: tree.model_error,
            self,
            None if errors is None else errors.with_ports(ports),
            is_leaf=lambda leaf: leaf is None or isinstance(leaf, ModalErrors),
        )

    def without(self, name: str) -> "Experiment":
        """Return the experiment without one of its effects.

        Raises
        ------
        ValueError
            If there is no such effect.
        """
        for effects in (lambda tree: tree.structure.effects, lambda tree: tree.instrument_effects):
            remaining = OrderedDict(effects(self))
            if remaining.pop(str(name), None) is not None:
                fewer = eqx.tree_at(effects, self, remaining, is_leaf=is_dict)
                return fewer.with_errors(fewer.model_error)
        raise InputError(
            f'There is no effect "{name}" to leave out. The experiment has '
            f"{', '.join(effect.name for effect in self.effects) or 'none'}."
        )

    @property
    def unknowns(self) -> list[Unknown]:
        """Every unknown with its owner, prior and unit, in the order in which they are sampled."""
        return unknowns(self)

    @property
    def unknown(self) -> dict[str, Unknown]:
        """Every unknown by its name."""
        return {unknown.name: unknown for unknown in self.unknowns}

    def unknowns_of(self, effect: Effect) -> list[Unknown]:
        """Unknowns that belong to one of the effects."""
        check_annotated("effect", effect, Effect)
        kind = "instrument_effects" if isinstance(effect, InstrumentEffect) else "effects"
        return [each for each in self.unknowns if each.owner == Owner(kind, effect.name)]

    @property
    def sensor_channels(self) -> tuple[Channel, ...]:
        """Channels of all sensors, in order."""
        return _channels(self.sensor)

    @property
    def actuator_channels(self) -> tuple[Channel, ...]:
        """Channels of all actuators, in order."""
        return _channels(self.actuator)

    def fix(self, values: Mapping[str, object]) -> "Experiment":
        """Return the experiment with some unknowns replaced by values, by name.

        Raises
        ------
        ValueError
            If a name is not an unknown, or a value is not possible.
        """
        return fixed(self, values)

    def nominal(self) -> "Experiment":
        """Return the experiment at recorded positions and at the prior mean of all else."""
        return self.fix(self.nominal_values())

    def nominal_values(self) -> dict[str, object]:
        """Recorded position or prior mean of each unknown, by name."""
        return {unknown.name: self._nominal_value(unknown) for unknown in self.unknowns}

    def _nominal_value(self, unknown: Unknown) -> object:
        if unknown.is_placement and unknown.field == "position":
            side = self.sensor if unknown.owner.kind == "sensor" else self.actuator
            return side[unknown.owner.name].at_record(unknown.component)
        return typical(unknown.distribution)

    def receptance(self) -> Receptance:
        """Receptance [m/N] of the structure at the lines, as its instruments recorded it.

        Raises
        ------
        InputError
            If it depends on something that is still a distribution.
        """
        _experiment_checks.driven(self.observe)
        _experiment_checks.all_known(self)
        if self.force_levels is None:
            return self._receptance(None)
        # Where nothing depends on the force it is computed once.
        return jax.vmap(self._receptance, out_axes=2)(jnp.asarray(self.force_levels))

    def _receptance(self, level: Float[Array, ""] | None) -> Receptance:
        """Receptance [m/N] at one force level [N]."""
        omega = self._omega()
        force = None if level is None else jnp.broadcast_to(level, omega.shape)
        drive = Drive(omega, force, self.sensors_mounted)
        effects = [effect for _, effect in sorted(self.instrument_effects.items())]
        return recorded(self.structure, self.instruments, effects, drive, self.model_error)

    def _omega(self) -> Float[Array, "frequency"]:
        return 2 * jnp.pi * jnp.asarray(self.frequency)

    def frf(self) -> Receptance:
        """FRF of the observed quantity, once no structure or placement is unknown, Eq. (18)."""
        effects = self.instrument_effects.values()
        return self.observe.frf(self.receptance(), recorded_frequency(effects, self._omega()))

    def predict(self) -> Response:
        """Outputs z without output error, Eq. (20)."""
        return self.observe.predicted(self)

    def data(self, measurement: Measurements) -> Data:
        """Outputs of a measurement at the lines and channels of this experiment.

        Parameters
        ----------
        measurement
            One measurement, or one for each force level, in any order.

        Raises
        ------
        ValueError
            If a line, a channel or a force level of the experiment was not measured.
        """
        observed = self.observe.data(measurement)
        if observed is not None:
            return observed
        runs = [self._data(run) for run in at_levels(measurement, self.force_levels)]
        return runs[0] if self.force_levels is None else Data.at_levels(runs)

    def check_data(self, measurement: Measurements) -> DataChecks:
        """Look for faults of a measurement that no model explains, before any inference.

        Parameters
        ----------
        measurement
            One measurement, or one for each force level.

        Raises
        ------
        ValueError
            If a channel or a force level of the experiment was not measured.
        """
        return check_data(self, measurement)

    def _data(self, measurement: Measurement) -> Data:
        chosen = (
            measurement.lines(np.asarray(self.frequency))
            .channels(self.sensor_channels, self.actuator_channels)
            .converted(self.observe.quantity)
        )
        variance = None if self.noise is None else self.noise.variance(chosen)
        amplitude = self.noise is not None and self.noise.reads_amplitude
        data = measured_outputs(self.observe, chosen.frf, variance, amplitude=amplitude)
        is_read = self.noise is None or self.noise.reads_coherence
        if is_read or not any(map(is_unknown, jax.tree.leaves(self.noise, is_leaf=is_unknown))):
            return data
        return with_scatter(data, self.observe, chosen.frf, chosen.line_scatter)

    def model(self, measurement: Measurements | Data | None = None) -> None:
        """Run the NumPyro model: prior on h, latent placement, Gaussian output error.

        Parameters
        ----------
        measurement
            What was measured; None to simulate.
        """
        concrete = realise(self)
        predicted = concrete.predict()
        data = measurement if isinstance(measurement, Data | None) else self.data(measurement)
        if data is None:
            numpyro.deterministic(RESPONSE, predicted)
        if concrete.noise is None:
            _experiment_checks.no_data_without_noise(data)
            return
        observed = None if data is None else data.z
        if data is None and concrete.noise.reads_amplitude:
            data = simulated_outputs(self.observe, concrete.frf())
        data = self.observe.own_data() if data is None else data
        numpyro.sample(MEASURED, concrete.noise.distribution(predicted, data), obs=observed)

    def nominal_measurement(self) -> Measurement | tuple[Measurement, ...]:
        """Return what the nominal experiment would measure without output error, z_nom.

        With force levels, one measurement for each level.
        """
        frf = np.asarray(compiled(_frf)(self.nominal()))
        if self.force_levels is None:
            return self._measurement(frf, None)
        levels = enumerate(self.force_levels)
        return tuple(self._measurement(frf[:, :, number], level) for number, level in levels)

    def _measurement(self, frf: np.ndarray, force_level: float | None) -> Measurement:
        return Measurement.from_arrays(
            frf,
            self.frequency,
            sensors=self.sensor_channels,
            actuators=self.actuator_channels,
            quantity=self.observe.quantity,
            force_level=force_level,
        )

    def __str__(self) -> str:
        """Lay out every prior and unit in one table."""
        return "\n".join([repr(self), *prior_table(self.unknowns)])

    def __repr__(self) -> str:
        """Say how many channels and lines are observed."""
        return sentence_on(self)

    _repr_html_ = noun_html


def _frf(concrete: Experiment) -> Receptance:
    return concrete.frf()


def _channels(transducers: Mapping[str, Transducer]) -> tuple[Channel, ...]:
    return tuple(channel for transducer in transducers.values() for channel in transducer.channels)
