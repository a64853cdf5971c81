"""alternative: in, a posterior; out, its draws by name, as one explanation of the data.

Not known here: how explanations were found, where they would be told apart.
"""

from collections.abc import Mapping
from typing import Any, TypeAlias

import equinox as eqx
import numpy as np
import xarray as xr

from ..experiment.experiment import Experiment

Draws: TypeAlias = dict[str, np.ndarray]
"""Draws of equal weight that belong together [draw, ...], by the name of the unknown."""


def draws_of(posterior: xr.DataTree | Mapping[str, Any] | None) -> Draws | None:
    """Draws of a result of `infer`, or draws by name, as one row of them each."""
    if posterior is None:
        return None
    if isinstance(posterior, xr.DataTree):
        whole = posterior["posterior"].to_dataset().stack(draw_of_all=("chain", "draw"))
        one = whole.transpose("draw_of_all", ...)
        return {str(name): one[name].values for name in one.data_vars}
    return {name: np.asarray(values) for name, values in posterior.items()}


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
    """

    name: str = eqx.field(static=True)
    probability: float = eqx.field(static=True)
    experiment: Experiment
    draws: Draws = eqx.field(converter=draws_of)
