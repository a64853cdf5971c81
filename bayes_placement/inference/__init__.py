"""inference: what the data say about everything unknown, by several engines and marginals."""

from . import engines, marginals
from .infer import infer
from .report import report
from .simulate import simulate

__all__ = ["engines", "infer", "marginals", "report", "simulate"]
