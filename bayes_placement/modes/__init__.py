"""modes: natural frequencies and mass-normalised mode shapes, from closed forms or elements."""

from . import beams, finite_elements
from .modes import Modes

__all__ = ["Modes", "beams", "finite_elements"]
