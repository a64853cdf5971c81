"""The experiment of a measurement to come, whose output error is known beforehand."""

import equinox as eqx
import numpy as np

from .._shared.arguments import arguments_checked
from .._shared.errors import InputError
from .._shared.sites import Role
from ..experiment.experiment import Experiment, Measurements
from ..experiment.noise import Gaussian
from ..experiment.observe import LogAmplitude


@arguments_checked
def planned(
    experiment: Experiment, measurement: Measurements | None = None, sigma: float | None = None
) -> Experiment:
    """Return an experiment for a measurement that is still to come.

    Levels that only data determine are replaced: an unknown level of the output error by the mean
    of its prior, and an error that is read from a measurement by one of the same relative size at
    all lines, which in log10 of the amplitude is a constant.

    Parameters
    ----------
    experiment
        The experiment.
    measurement
        An earlier measurement of the same kind, whose coherence or variance gives the relative
        error: the median over all its data is taken.
    sigma
        Standard deviation of log10 of the amplitude, instead of a measurement.

    Returns
    -------
    Experiment
        One with a known output error; of log10 of the amplitude where `sigma` or a measurement
        gives the error.

    Raises
    ------
    InputError
        If the error is read from a measurement, and neither is given.

    Examples
    --------
    >>> log = {"observe": bp.observe.LogAmplitude("velocity"), "noise": bp.noise.FromCoherence()}
    >>> bp.design.planned(bp.Experiment(structure, **setup | log), sigma=0.02).noise
    Gaussian(sigma=0.02 [unit of z])
    """
    noise = experiment.noise
    if sigma is not None:
        return _with_logarithmic_error(experiment, sigma)
    if noise is None or not noise.reads_measurement:
        typical = experiment.nominal_values()
        levels = [
            unknown.name for unknown in experiment.unknowns if unknown.role is Role.OUTPUT_ERROR
        ]
        return experiment.fix({name: typical[name] for name in levels})
    if measurement is None:
        raise InputError(
            f"The output error is declared as noise.{type(noise).__name__}(), which reads it from "
            "a measurement, but what is planned is not measured yet. Give an earlier measurement "
            "of the same kind, or the standard deviation of log10 of the amplitude: sigma=0.01."
        )
    return _with_logarithmic_error(experiment, _logarithmic_error(experiment, measurement))


def _with_logarithmic_error(experiment: Experiment, sigma: float) -> Experiment:
    replaced = (experiment.observe, experiment.noise)
    return eqx.tree_at(
        lambda tree: (tree.observe, tree.noise),
        experiment,
        (LogAmplitude(experiment.observe.quantity), Gaussian(sigma)),
        is_leaf=lambda node: node is None or any(node is old for old in replaced),
    )


def _logarithmic_error(experiment: Experiment, measurement: Measurements) -> float:
    """Median standard deviation of log10 of the amplitude."""
    data = experiment.data(measurement)
    assert experiment.noise is not None
    deviation = experiment.noise.deviation(data)
    if deviation is None:
        raise InputError(
            "The size of the output error is unknown even with the measurement: part of it is a "
            "distribution. Give the standard deviation of log10 of the amplitude: sigma=0.01."
        )
    sigma, measured = np.asarray(deviation), np.asarray(data.measured)
    if experiment.observe.parts == 1:
        return float(np.median(sigma[measured]))
    # Half of the variance lies along the FRF, in its amplitude; the other half in its phase.
    radial = np.sqrt(np.mean(sigma**2, axis=-2))
    amplitude = np.sqrt(np.sum(np.asarray(data.z) ** 2, axis=-2))
    complete = np.all(measured, axis=-2)
    return float(np.median(radial[complete] / amplitude[complete]) / np.log(10))
