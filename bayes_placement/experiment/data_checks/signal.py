"""Records without a signal, in which a search would explain noise."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr

from ..._shared.errors import InputError
from .._experiment_checks import at_levels
from ..measurement import Measurement
from ..modal_parameters import ModalParameters

if TYPE_CHECKING:
    from ..experiment import Experiment

LEVEL = 0.05
"""Probability with which noise alone is taken for a signal."""

FEWEST_VALUES = 64
"""Fewest values that are looked at: few lines of narrow resonances may scatter as noise does."""

LEAST = float(np.sqrt(np.finfo(float).tiny))
"""Least FRF whose square is a number of full precision."""

SPREAD, KURTOSIS = np.pi**2 / 24, 5.4
"""Variance of the logarithm of the amplitude of complex Gaussian noise, and its kurtosis."""

Scores = Float[np.ndarray, "test"]


def check_signal(
    experiment: "Experiment", measurement: Measurement | ModalParameters | Sequence[Measurement]
) -> None:
    """Refuse FRFs that noise alone explains, whatever its level."""
    if experiment.observe.is_modal or experiment.noise is None:
        return
    channels = experiment.sensor_channels, experiment.actuator_channels
    runs = [run.channels(*channels) for run in at_levels(measurement, experiment.force_levels)]
    frfs = [run.frf[tuple(pair)] for run in runs for pair in np.argwhere(run.measured)]
    size = max((float(np.abs(frf).max()) for frf in frfs), default=0.0)
    if size < LEAST:
        raise InputError(
            f"There is no signal: the greatest FRF is {size:g}; responses of a structure are "
            "needed, since a search explains what was measured. Look at the units and at the "
            "cables, and measure again."
        )
    if sum(map(len, frfs)) >= FEWEST_VALUES and not is_signal(frfs):
        raise InputError(
            "There is no signal: FRFs at neighbouring lines have no more in common than noise has, "
            "and their amplitudes scatter as those of noise do; responses of a structure are "
            "needed, since a search would explain noise. Look at sensors and cables, measure with "
            "more force, or average more."
        )


def is_signal(frfs: Sequence[np.ndarray]) -> bool:
    """Whether FRFs of a pair each are no noise, which is independent from line to line."""
    scores = np.sum([_scores(frf) for frf in frfs], axis=0) / np.sqrt(len(frfs))
    p_values = 2 * ndtr(-np.abs(scores))
    return bool(p_values.min() < LEVEL / p_values.size)


def _scores(frf: np.ndarray) -> Scores:
    """Standard scores of an FRF: likeness of neighbours, of their sizes, and scatter of these."""
    if not np.any(frf):
        return np.zeros(3)
    size = np.log(np.maximum(np.abs(frf), LEAST))
    scatter = (np.var(size) / SPREAD - 1) * np.sqrt(len(frf) / (KURTOSIS - 1))
    return np.array([_likeness(frf), _likeness(size), scatter])


def _likeness(values: np.ndarray) -> float:
    """Correlation of neighbours over its deviation (von Neumann, 1941)."""
    apart = values - values.mean()
    squares = float(np.sum(np.abs(apart) ** 2))
    if squares <= len(values) * (LEAST + np.finfo(float).eps * np.abs(values.mean())) ** 2:
        return 0.0
    alike = float(np.sum(apart[1:] * apart[:-1].conj()).real) / squares
    independent = 2 if np.iscomplexobj(values) and np.any(apart.imag) else 1
    return (alike + 1 / len(values)) * np.sqrt(independent * len(values))
