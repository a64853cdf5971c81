"""Natural frequencies and mass-normalised mode shapes, from closed forms or finite elements."""

from . import beams, finite_elements
from .modes import Modes

__all__ = ["Modes", "beams", "finite_elements"]
