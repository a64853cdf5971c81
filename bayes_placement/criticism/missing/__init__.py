"""Which physical effect is missing, and how far the error falls once it is added."""

from .decide import decide
from .explain import explain
from .improve import improve
from .reach import reach
from .table import Policy

__all__ = ["Policy", "decide", "explain", "improve", "reach"]
