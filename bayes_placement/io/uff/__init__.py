"""uff: universal files, in and out."""

from .uff import read
from .uff_modes import read as read_modes

__all__ = ["read", "read_modes"]
