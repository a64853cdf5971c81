"""planned: in, an experiment and what was measured; out, one of which the output error is known.

Not known here: where to measure, how information is estimated.
"""

import equinox as eqx
import numpy as np

from .._sites import Role
from .._types import InfeasibleError
from ..experiment.experiment import Experiment, Measurements
from ..experiment.noise import Gaussian
from ..experiment.observe import LogAmplitude


def planned(
    experiment: Experiment, measurement: Measurements | None = None, sigma: float | None = None
) -> Experiment:
    """Return an experiment for a measurement that is still to come.

    What is only known with data in hand is replaced: an unknown level of the output error by the
    mean of its prior, and an error that is read from coherence by one of the same relative size at
    all lines, which in log10 of the amplitude is a constant.

    Parameters
    ----------
    experiment
        The experiment.
    measurement
        An earlier measurement of the same kind, whose coherence tells the relative error: the
        median over all its data is taken.
    sigma
        Standard deviation of log10 of the amplitude, in the place of a measurement.

    Raises
    ------
    ValueError
        If the error is read from coherence, and neither is given.
    """
    noise = experiment.noise
    if sigma is not None:
        return _logarithmic(experiment, sigma)
    if noise is None or not noise.reads_coherence:
        typical = experiment.nominal_values()
        levels = [one.name for one in experiment.unknowns if one.role is Role.OUTPUT_ERROR]
        return experiment.fix({name: typical[name] for name in levels})
    if measurement is None:
        raise InfeasibleError(
            f"The output error is declared as noise.{type(noise).__name__}(), which reads it from "
            "a measurement, but what is planned is not measured yet. Give an earlier measurement "
            "of the same kind, or the standard deviation of log10 of the amplitude: sigma=0.01."
        )
    return _logarithmic(experiment, _relative(experiment, measurement))


def _logarithmic(experiment: Experiment, sigma: float) -> Experiment:
    old = (experiment.observe, experiment.noise)
    new = (LogAmplitude(experiment.observe.quantity), Gaussian(sigma))
    return eqx.tree_at(
        lambda tree: (tree.observe, tree.noise),
        experiment,
        new,
        is_leaf=lambda node: node is None or any(node is one for one in old),
    )


def _relative(experiment: Experiment, measurement: Measurements) -> float:
    """Median standard deviation of log10 of the amplitude."""
    data = experiment.data(measurement)
    assert experiment.noise is not None
    deviation = experiment.noise.deviation(data)
    if deviation is None:
        raise InfeasibleError(
            "The size of the output error is unknown even with the measurement: its factor is a "
            "distribution. Give the standard deviation of log10 of the amplitude: sigma=0.01."
        )
    level, there = np.asarray(deviation), np.asarray(data.measured)
    if experiment.observe.parts == 1:
        return float(np.median(level[there]))
    # Half of the variance lies across the FRF, in its phase.
    along = np.sqrt(np.mean(level**2, axis=-2))
    size = np.sqrt(np.sum(np.asarray(data.z) ** 2, axis=-2))
    whole = np.all(there, axis=-2)
    return float(np.median(along[whole] / size[whole]) / np.log(10))
