"""compare: which of two fitted models predicts the data better."""

from .compare import compare

__all__ = ["compare"]
