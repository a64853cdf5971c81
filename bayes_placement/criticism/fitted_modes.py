"""Modes of a model with values of its unknowns, beside those measured or identified from FRFs."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from .._shared.compiled import compiled
from .._shared.errors import InputError
from ..experiment.experiment import Experiment, Measurements
from ..experiment.identification import identified
from ..experiment.measurement import Measurement
from ..experiment.modal_parameters import DAMPING, FREQUENCY, SHAPE, ModalParameters
from ..experiment.observed_modes import ModalData, ModesOfModel
from ..experiment.variants import observing_modes
from .fitted import with_arrays

FURTHER_MODES = 2
"""Modes of the model, above those that were measured, whose shapes are compared as well."""

QUANTITIES = {"natural_frequency": (FREQUENCY, "Hz"), "damping_ratio": (DAMPING, "1")}
"""Row and unit of what each mode has once."""

SUFFIXES = ("", "_deviation", "_of_model")
"""What is measured, its standard deviation, and what the model has."""


def fitted_modes(
    experiment: Experiment, measurement: ModalParameters, values: Mapping[str, float]
) -> xr.Dataset:
    """Return measured modal parameters and those of the model, and how alike the shapes are.

    Parameters
    ----------
    experiment
        An experiment that observes modes.
    measurement
        What was measured.
    values
        Value of every unknown, elements of arrays one by one (`structure.damping.ratio[0]`).

    Returns
    -------
    xarray.Dataset
        For each measured mode `natural_frequency` [Hz], `damping_ratio` and, by sensor, `shape`,
        each with `_deviation` and `_of_model`, shapes of the model in the scale of the measured
        ones; `number`, that of the mode of the model; and `assurance`, the modal assurance
        criterion with each mode of the model.

    Examples
    --------
    >>> from bayes_placement.criticism.fitted_modes import fitted_modes
    >>> modes = bp.ModalParameters([160.0, 330.0], [0.1, 0.2], number=[1, 2])
    >>> modal = bp.Experiment(
    ...     structure,
    ...     sensors=[],
    ...     observe=bp.observe.ModalData(modes),
    ...     noise=bp.noise.FromVariance(),
    ... )
    >>> fitted_modes(modal, modes, {"structure.damping.ratio": 0.04})["number"].values.tolist()
    [1, 2]
    """
    concrete = experiment.fix(with_arrays(experiment, values))
    model = modes_of_model(concrete)
    measured = measurement.channels(experiment.sensor_channels) if experiment.sensor else None
    measured = measurement.without_shapes() if measured is None else measured
    variables: dict[str, tuple[object, ...]] = {"number": ("mode", model.number)}
    for name, (row, unit) in QUANTITIES.items():
        of = (measured.values[row], measured.deviation[row], model.values[row])
        for suffix, array in zip(SUFFIXES, of, strict=True):
            variables[f"{name}{suffix}"] = ("mode", array, {"units": unit})
    if measured.sensors:
        shapes = (measured.shape, measured.deviation[SHAPE:], _scaled(measured, model))
        for suffix, array in zip(SUFFIXES, shapes, strict=True):
            variables[f"shape{suffix}"] = (("sensor", "mode"), array, {"units": "as measured"})
        compared = min(int(model.number.max()) + FURTHER_MODES, model.assurance.shape[1])
        criterion = model.assurance[:, :compared]
        variables["assurance"] = (("mode", "mode_of_model"), criterion, {"units": "1"})
        variables["mode_of_model"] = ("mode_of_model", np.arange(1, compared + 1))
    labels = [channel.label for channel in measured.sensors]
    count = measured.natural_frequency.size
    return xr.Dataset(variables, coords={"mode": np.arange(1, count + 1), "sensor": labels})


def modes_of_model(concrete: Experiment) -> ModesOfModel:
    """Modes of a model without unknowns that observes modes, paired with those measured."""
    return ModesOfModel(*map(np.asarray, compiled(_of_model)(concrete)))  # type: ignore[arg-type]


def _scaled(measured: ModalParameters, model: ModesOfModel) -> np.ndarray:
    """Shapes of the model in the scale that is nearest to the measured ones."""
    weight = measured.deviation[SHAPE:] ** -2.0
    shape = model.values[SHAPE:]
    product = np.nansum(weight * measured.shape * shape, axis=0)
    square = np.nansum(weight * shape**2, axis=0)
    return shape * product / np.where(square > 0, square, 1.0)


def _of_model(concrete: Experiment) -> ModesOfModel:
    assert isinstance(concrete.observe, ModalData)
    return concrete.observe.of_model(concrete)


def identified_beside_model(
    experiment: Experiment, measurement: Measurements, values: Mapping[str, float]
) -> list[str]:
    """Say natural frequencies and damping ratios of both, a sentence a mode.

    Nothing where no mode is identified, or nothing tells which of the model it is: shapes at two
    sensors are needed. Model error is left out, so that all that the model lacks is seen.

    The experiment observes FRFs; elements of arrays are given one by one.
    """
    if not isinstance(measurement, Measurement):
        return []
    try:
        modes = identified(measurement, "sensors").modes
        modal = observing_modes(experiment.with_errors(None), modes)
        beside = fitted_modes(modal, modes, values)
    except InputError:
        return []
    return [_sentence(beside.isel(mode=mode)) for mode in range(beside.sizes["mode"])]


def _sentence(mode: xr.Dataset) -> str:
    """Both answers on one mode."""
    word = {name: mode[name].item() for name in ("number", *_OF_MODE)}
    frequency, error, of_model, damping, damping_of_model = (word[name] for name in _OF_MODE)
    return (
        f"Mode {word['number']}: the FRFs alone have {frequency:.6g} ± {error:.2g} Hz and a "
        f"damping ratio of {damping:.3g}, the model {of_model:.6g} Hz "
        f"({of_model / frequency - 1:+.2%}) and {damping_of_model:.3g}."
    )


_OF_MODE = (
    *("natural_frequency", "natural_frequency_deviation", "natural_frequency_of_model"),
    *("damping_ratio", "damping_ratio_of_model"),
)
