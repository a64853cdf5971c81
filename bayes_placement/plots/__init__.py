"""Figures of results; one file for each kind of result."""

from . import ledger, misfit, placement, posterior, structure

__all__ = ["ledger", "misfit", "placement", "posterior", "structure"]
