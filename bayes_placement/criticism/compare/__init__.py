"""Which of several fitted models predicts the data better."""

from .compare import compare

__all__ = ["compare"]
