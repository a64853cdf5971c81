"""What the lines of a script of the page call, and the page itself: so both have the same numbers.

They stand on the public functions of the package; a script needs them, `bp` and nothing else.
"""

from collections.abc import Mapping

import numpy as np

from ..experiment.experiment import Experiment, Measurements
from ..inference.estimates import scalars
from .response import ResponseOf


def as_drawn(experiment: Experiment) -> dict[str, float]:
    """Return recorded positions and the means of all other priors, elements of arrays one by one.

    Examples
    --------
    >>> from bayes_placement.explorer.steps import as_drawn
    >>> {name: round(value, 3) for name, value in as_drawn(experiment).items()}
    {'structure.damping.ratio': 0.04, 'sensor.s1.position': 0.2}
    """
    return {
        word: number[0, 0].item()  # that of a node stays whole
        for name, value in experiment.nominal_values().items()
        for word, number in scalars(name, np.asarray(value)[None, None])
    }


def chi2(experiment: Experiment, measurement: Measurements, values: Mapping[str, float]) -> float:
    """Return the reduced chi-square of a model with values of its unknowns.

    Elements of arrays have values one by one.

    Examples
    --------
    >>> from bayes_placement.explorer.steps import as_drawn, chi2
    >>> round(chi2(experiment, measured, as_drawn(experiment)), 2)
    0.73
    """
    return ResponseOf(experiment, experiment.data(measurement))(values).chi2


def fit(
    experiment: Experiment, measurement: Measurements, values: Mapping[str, float]
) -> dict[str, float]:
    """Return the values of the best fit to which descents from given values lead.

    Examples
    --------
    >>> from bayes_placement.explorer.steps import as_drawn, fit
    >>> fitted = fit(experiment, measured, as_drawn(experiment))
    >>> abs(fitted["structure.damping.ratio"] - 0.04) < 0.001
    True
    """
    from ..criticism.missing.from_values import fitted_from  # the page stands before it is needed

    return fitted_from(experiment, measurement, values, lambda values: None)
