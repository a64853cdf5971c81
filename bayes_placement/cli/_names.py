"""Names of engines, marginals, estimators and searches, known without importing any of them."""

from typing import Literal

EngineName = Literal["all", "importance", "grid", "map", "nuts", "smc"]
FitEngineName = Literal["map", "smc", "nuts"]
MarginalName = Literal["latent", "quadrature", "kde"]
EstimatorName = Literal["kde", "exact", "expected-gain", "separation"]
SearchName = Literal["exhaustive", "sequential", "forward", "evolutionary"]
