"""The measurement to come, and where one more sensor would tell most: a search of bounded time.

The output error of that measurement is known beforehand.
"""

import time
import warnings
from collections.abc import Sequence

import equinox as eqx
import numpy as np
import pandas as pd

from .._shared.arguments import arguments_checked
from .._shared.errors import InputError, PackageError
from .._shared.sites import Role
from ..experiment.experiment import Experiment, Measurements
from ..experiment.noise import Gaussian
from ..experiment.observe import LogAmplitude
from ..experiment.transducers import Sensor
from ..experiment.variants import with_lines
from ..inference.alternative_explanation import Alternative
from ..positions.bounds import position_text
from . import information
from ._candidates import can_be_at, positions_on
from .information.estimator import Estimator
from .maps import SIGNIFICANT
from .place import place, position_columns

LINES, PLACES = 12, 15
"""Frequency lines and places of the search: few, since a person waits."""

GROUPS = 3
"""Groups in which the places are tried, each of them all over the structure."""

SECONDS = 6.0
"""Time after which no further group is tried [s]."""


def next_measurement(
    experiment: Experiment, measurement: Measurements, alternatives: Sequence[Alternative]
) -> dict[str, object]:
    """Return where one more measurement with the first sensor moved decides most.

    That is where the explanations that are left are told apart best (`Separation`). All other
    instruments stay where they are.

    The experiment has the effects that were found; the alternative reported first comes first. The
    result is a `sentence`, and the places with their expected gain: `columns`, `rows`, a `caption`.
    """
    if len(alternatives) < 2:
        words = "Only one explanation is left, so a next measurement has nothing to decide"
        return _only(f"{words}. Where it makes numbers more precise: bayes-placement place MODEL.")
    sensor = next(iter(experiment.sensor.values()))
    try:
        few = with_lines(planned(experiment, measurement), LINES)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", information.InformationWarning)
            estimator = information.Separation(alternatives=tuple(alternatives))
            best = _search(few, sensor.name, estimator)
    except PackageError as error:
        return _only(f"Where to measure next was not searched for: {error}")
    return _in_words(best, sensor, alternatives)


def _only(sentence: str) -> dict[str, object]:
    """A sentence in the place of a search."""
    return {"sentence": sentence, "columns": [], "rows": [], "caption": ""}


def _search(experiment: Experiment, sensor: str, estimator: Estimator) -> pd.DataFrame:
    """Try places in groups, each spread over the structure, as long as the time allows.

    Groups of one size share their compiled program, and all places their random points.
    """
    positions = [
        at
        for at in positions_on(experiment, PLACES)
        if can_be_at(experiment, experiment.sensor[sensor], at)
    ]
    began, tables = time.perf_counter(), list[pd.DataFrame]()
    for number in range(GROUPS):
        group = positions[number::GROUPS]
        if group and (not tables or time.perf_counter() - began < SECONDS):
            tables.append(place(experiment, {sensor: group}, estimator=estimator).table)
    return pd.concat(tables).sort_values("information_gain", ascending=False)


def _in_words(
    table: pd.DataFrame, sensor: Sensor, alternatives: Sequence[Alternative]
) -> dict[str, object]:
    axes = position_columns(sensor.name, sensor.recorded)
    best = table.iloc[0]
    where = position_text(np.round(best[axes].to_numpy(float).squeeze(), 4))
    shares = np.array([alternative.probability for alternative in alternatives])
    shares /= shares.sum()
    entropy = float(-(shares * np.log(shares)).sum())
    gain, error = best["information_gain"], best["information_gain_se"]
    names = " and ".join(alternative.name for alternative in alternatives[:2])
    learnt = f"{gain:.2g} ± {error:.1g} nat of the {entropy:.2g} nat that decide"
    # An estimate far below zero is a bound that says nothing.
    most = f": at most {learnt}" if gain > -entropy else ""
    found = (
        f"With {sensor.name} at {where} m, and all else where it is, one more measurement tells "
        f"{names} apart best: {learnt}."
        if gain > SIGNIFICANT * error
        else f"Wherever {sensor.name} is, one more measurement does not tell {names} apart{most}. "
        "Other lines or less noise may."
    )
    shown = table[[*axes, "information_gain", "information_gain_se"]]
    return {
        "sentence": found,
        "columns": [*(f"{axis} [m]" for axis in axes), "expected gain [nat]", "its error [nat]"],
        "rows": shown.to_numpy(float).tolist(),
        "caption": f"Expected gain of one more measurement with {sensor.name} moved; its tolerance "
        "counts, bars are two standard errors.",
    }


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
