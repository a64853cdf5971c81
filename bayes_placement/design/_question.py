"""_question: in, an experiment and what is asked; out, what it is about, and all nominal values.

Not known here: places to try, how information is estimated.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp

from .._types import InfeasibleError, InputError
from ..experiment.experiment import Experiment, is_placement, role


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
    found = experiment.nominal_values()
    parameters = [name for name in found if role(name) == "parameter h"]
    _refuse_strange(given, found)
    if about is None:
        return experiment, given
    strange = [name for name in about if name not in parameters]
    if strange or not about:
        raise InfeasibleError(
            f"about={list(about)} was given; names of unknown parameters are needed. Those are "
            f"{', '.join(parameters)}."
        )
    held = {name: given.pop(name, found[name]) for name in parameters if name not in about}
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
    of_moved = tuple(f"{kind}.{name}.position" for kind in ("sensor", "actuator") for name in moved)
    return {
        name: jnp.asarray(given.get(name, typical.get(name, value)))
        for name, value in experiment.nominal_values().items()
        if not name.startswith(of_moved)
    }


def _refuse_strange(given: Mapping[str, float], found: Mapping[str, Any]) -> None:
    strange = [name for name in given if name not in found or is_placement(name)]
    if strange:
        names = ", ".join(name for name in found if not is_placement(name))
        raise InputError(
            f"A nominal value of {strange[0]} was given, which is no unknown parameter; those are "
            f"{names}. Places are taken where they are recorded."
        )
