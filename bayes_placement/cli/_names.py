"""Names of engines, marginals, estimators and searches, known without importing any of them."""

from typing import TYPE_CHECKING, Literal

from ..inference import engines, marginals
from ..inference.names import names

if TYPE_CHECKING:
    EngineName = str
    FitEngineName = str
    MarginalName = str
else:  # names of the registries are only known when this runs
    EngineName = Literal[("all", *names(engines))]
    FitEngineName = Literal[tuple(names(engines))]
    MarginalName = Literal[tuple(names(marginals))]

EstimatorName = Literal["kernel-gain", "exact", "expected-gain", "separation"]
SideName = Literal["sensors", "actuators"]
SearchName = Literal["exhaustive", "sequential", "forward", "evolutionary"]
