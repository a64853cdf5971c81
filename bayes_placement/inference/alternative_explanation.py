"""One explanation of earlier data among others: an experiment and draws of its unknowns."""

from collections.abc import Mapping
from typing import TypeAlias

import equinox as eqx
import numpy as np
import xarray as xr

from .._shared.arguments import check_annotated, check_fields
from .._shared.errors import InputError
from .._shared.reprs import with_short_repr
from ..experiment.experiment import Experiment

JointDraws: TypeAlias = dict[str, np.ndarray]
"""Draws of equal weight that belong together [draw, ...], by the name of the unknown."""


def draws_of(posterior: xr.DataTree | Mapping[str, object] | None) -> JointDraws | None:
    """Draws [draw, ...] by name, from a result of `infer` (chains in a row) or from such draws."""
    check_annotated("after", posterior, xr.DataTree | Mapping[str, object] | None)
    if posterior is None:
        return None
    if isinstance(posterior, xr.DataTree):
        stacked = posterior["posterior"].to_dataset().stack(chain_and_draw=("chain", "draw"))
        draws = stacked.transpose("chain_and_draw", ...)
        return {str(name): draws[name].values for name in draws.data_vars}
    return {name: np.asarray(values) for name, values in posterior.items()}


@with_short_repr
class Alternative(eqx.Module):
    """One explanation of earlier data.

    Parameters
    ----------
    name
        What it says, in a word.
    probability
        Its probability, relative to the others.
    experiment
        The experiment with the effects that it adds.
    draws
        Draws of its unknowns given the earlier data [draw, ...], by name; or what `infer` returned.

    Examples
    --------
    >>> delayed = bp.information.Alternative("late", 0.3, experiment, posterior)
    >>> delayed.name, delayed.probability
    ('late', 0.3)
    """

    name: str = eqx.field(static=True)
    probability: float = eqx.field(static=True)
    experiment: Experiment
    draws: JointDraws = eqx.field(converter=draws_of)

    def __check_init__(self) -> None:
        check_fields(self)
        if not (self.name and self.probability >= 0):
            raise InputError(
                f"Alternative({self.name!r}, probability={self.probability:g}) was given; a name "
                "and a probability that is not negative are needed, since explanations are "
                'weighed: Alternative("nothing", 0.5, experiment, posterior).'
            )
