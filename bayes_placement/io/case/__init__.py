"""case: folders with `case.json` and universal files."""

from .case import read

__all__ = ["read"]
