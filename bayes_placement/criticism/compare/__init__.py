"""Comparison of fitted models of the same data."""

from .compare import compare

__all__ = ["compare"]
