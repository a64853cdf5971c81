"""Figures of results; one file for each kind of result."""

from . import ledger, measurement, misfit, modes, placement, posterior, reach, report, structure
from .structure import experiment

__all__ = [
    "experiment",
    "ledger",
    "measurement",
    "misfit",
    "modes",
    "placement",
    "posterior",
    "reach",
    "report",
    "structure",
]
