"""Figures of results; one file for each kind of result."""

from ..positions.completion import offer_own
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

offer_own(ledger, measurement, misfit, modes, placement, posterior, reach, structure)
