"""What a run leaves for figures and reports: draws, fits, positions and mode shapes as arrays."""

from .findings import ABOUT, Model, draws_of_result, findings, models_of

__all__ = ["ABOUT", "Model", "draws_of_result", "findings", "models_of"]
