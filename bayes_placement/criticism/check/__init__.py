"""Whether a fitted model explains the data, and where it fails."""

from .check import check

__all__ = ["check"]
