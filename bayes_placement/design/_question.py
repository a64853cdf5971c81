"""_question: in, an experiment and what is asked; out, what it is about, and all nominal values.

Not known here: places to try, how information is estimated.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp

from .._sites import Role, Unknown
from .._types import InfeasibleError, InputError
from ..experiment.experiment import Experiment


def only_about(
    experiment: Experiment, about: Sequence[str] | None, nominal: Mapping[str, float] | None
) -> tuple[Experiment, dict[str, float]]:
    """Hold all parameters but some at their nominal values, as Case 1 of the paper.

    Returns
    -------
    tuple
        The experiment, and the nominal values that are still of use.

    Raises
    ------
    ValueError
        If there is no such parameter, or a nominal value is given for what is none.
    """
    given = dict(nominal or {})
    nominal_value, unknowns = experiment.nominal_values(), experiment.unknowns
    parameters = [unknown.name for unknown in unknowns if unknown.role is Role.PARAMETER]
    _refuse_strange(given, [unknown.name for unknown in unknowns if not unknown.is_placement])
    if about is None:
        return experiment, given
    strange = [name for name in about if name not in parameters]
    if strange or not about:
        raise InfeasibleError(
            f"about={list(about)} was given; names of unknown parameters are needed. Those are "
            f"{', '.join(parameters)}."
        )
    held = {name: given.pop(name, nominal_value[name]) for name in parameters if name not in about}
    return experiment.fix(held), given


def nominal_values(
    experiment: Experiment,
    moved: Sequence[str],
    given: Mapping[str, float],
    typical: Mapping[str, Any],
) -> dict[str, Any]:
    """Nominal value of each unknown but the positions of what is moved.

    Parameters
    ----------
    experiment
        The experiment.
    moved
        Names of the transducers that are moved.
    given
        Values that were asked for, by name.
    typical
        Values that are better than recorded places and means of priors, by name.
    """
    unknown = experiment.unknown
    return {
        name: jnp.asarray(given.get(name, typical.get(name, value)))
        for name, value in experiment.nominal_values().items()
        if not _is_position_of(unknown[name], moved)
    }


def _is_position_of(unknown: Unknown, transducers: Sequence[str]) -> bool:
    is_position = unknown.is_placement and unknown.field == "position"
    return is_position and unknown.owner.name in transducers


def _refuse_strange(given: Mapping[str, float], names: Sequence[str]) -> None:
    strange = [name for name in given if name not in names]
    if strange:
        raise InputError(
            f"A nominal value of {strange[0]} was given, which is no unknown parameter; those are "
            f"{', '.join(names)}. Places are taken where they are recorded."
        )
