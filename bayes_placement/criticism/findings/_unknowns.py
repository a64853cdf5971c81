"""Unknowns that are shown: all but the many errors of a model."""

from ..._sites import Role, Unknown
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
