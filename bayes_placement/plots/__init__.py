"""plots: figures of results, one kind of result a file; they compute nothing."""

from . import ledger, misfit, placement, posterior, structure

__all__ = ["ledger", "misfit", "placement", "posterior", "structure"]
