"""What a run leaves for figures and reports: draws, fits, positions and mode shapes as arrays."""

from .findings import Model, draws_of_result, findings, models_of

__all__ = ["Model", "draws_of_result", "findings", "models_of"]
