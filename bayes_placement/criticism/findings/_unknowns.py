"""Unknowns that are shown: all but the many errors of a model."""

import numpy as np
import xarray as xr

from ..._shared.ranges import ends
from ..._shared.sites import Role, Unknown
from ...experiment.experiment import Experiment

SIZE = "size"
"""Field of a model error that is its size."""


def shown_unknowns(experiment: Experiment) -> list[Unknown]:
    """Return the unknowns of an experiment; of a model error its sizes alone."""
    return [
        unknown
        for unknown in experiment.unknowns
        if unknown.role is not Role.MODEL_ERROR or unknown.field == SIZE
    ]


def with_bounds(experiment: Experiment, draws: xr.Dataset) -> xr.Dataset:
    """Return draws from priors, with the bounds of each prior that has some as its attribute."""
    for unknown in experiment.unknowns:
        bounds = ends(unknown.distribution) if unknown.name in draws else ()
        if bounds and np.isfinite(bounds).all():
            draws[unknown.name].attrs["prior_bounds"] = list(map(float, bounds))
    return draws
