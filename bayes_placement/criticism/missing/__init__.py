"""Which physical effect is missing, and how far the error falls once it is added."""

from .explain import explain
from .improve import improve
from .reach import reach

__all__ = ["explain", "improve", "reach"]
