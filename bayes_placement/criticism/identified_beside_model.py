"""Modes identified from FRFs, without a model, beside those that a model has: a second answer."""

from collections.abc import Mapping

import xarray as xr

from .._shared.errors import InputError
from ..experiment.experiment import Experiment, Measurements
from ..experiment.identification.identify import identified
from ..experiment.measurement import Measurement
from ..experiment.variants import observing_modes
from .fitted_modes import fitted_modes


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
