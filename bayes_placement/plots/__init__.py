"""Figures of results; one file for each kind of result."""

from . import ledger, misfit, placement, posterior, report, structure

__all__ = ["ledger", "misfit", "placement", "posterior", "report", "structure"]
