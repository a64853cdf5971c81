"""Parameters of interest of a design, and nominal values of all unknowns."""

from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._shared.errors import InputError
from .._shared.ranges import described, reach
from .._shared.sites import Role, Unknown
from ..experiment.experiment import Experiment


def with_parameters_of_interest(
    experiment: Experiment, about: Sequence[str] | None, nominal: Mapping[str, float] | None
) -> tuple[Experiment, dict[str, float]]:
    """Hold all parameters but those of interest at their nominal values, as Case 1 of the paper.

    Nominal values are the means of the priors by default; those of parameters that are still
    unknown are returned as well.
    """
    values = dict(nominal or {})
    _refuse_impossible(values, experiment)
    if about is None:
        return experiment, values
    typical = experiment.nominal_values()
    parameters = [unknown.name for unknown in experiment.unknowns if unknown.role is Role.PARAMETER]
    if not about or not set(about) <= set(parameters):
        raise InputError(
            f"about={list(about)} was given; names of unknown parameters are needed. Those are "
            f"{', '.join(parameters)}."
        )
    fixed = {name: values.pop(name, typical[name]) for name in parameters if name not in about}
    return experiment.fix(fixed), values


def nominal_values(
    experiment: Experiment,
    moved: Sequence[str],
    stated: Mapping[str, float],
    typical: Mapping[str, Any],
) -> dict[str, Any]:
    """Nominal value of each unknown but the positions of what is moved.

    Values that the user states come first, then typical ones, better than recorded positions and
    means of priors.
    """
    unknown = experiment.unknown
    return {
        name: jnp.asarray(stated.get(name, typical.get(name, value)))
        for name, value in experiment.nominal_values().items()
        if not _is_position_of(unknown[name], moved)
    }


def _is_position_of(unknown: Unknown, transducers: Sequence[str]) -> bool:
    is_position = unknown.is_placement and unknown.field == "position"
    return is_position and unknown.owner.name in transducers


def _refuse_impossible(nominal: Mapping[str, float], experiment: Experiment) -> None:
    """Refuse nominal values of what is no unknown parameter, and outside of the prior."""
    names = [unknown.name for unknown in experiment.unknowns if not unknown.is_of_transducer]
    for name in nominal:
        if name not in names:
            raise InputError(
                f"A nominal value of {name} was given, which is no unknown parameter; those are "
                f"{', '.join(names)}. The nominal positions of transducers are those recorded."
            )
    for name, value in nominal.items():
        prior = experiment.unknown[name].distribution
        low, high = reach(prior)
        if np.any(np.less(value, low)) or np.any(np.greater(value, high)):
            raise InputError(
                f"A nominal value of {value:g} was given for {name}, outside of its prior "
                f"{described(prior)}; one that the prior allows is needed, since the nominal data "
                f"are those of it. Give one from {low:.3g} to {high:.3g}."
            )
