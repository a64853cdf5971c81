"""Which physical effect is missing, and how far the error falls once it is added."""

from .explain import explain
from .improve import improve

__all__ = ["explain", "improve"]
