"""Estimators of how much an experiment teaches about its parameters, one a file; divergences."""

from ...inference.alternative_explanation import Alternative
from ...inference.divergence import (
    Divergence,
    from_evidence,
    from_posterior_draws,
    from_prior_draws,
)
from .estimator import InformationWarning
from .expected_gain import Exact, ExpectedGain
from .kernel_gain import KernelGain
from .separation import Separation

__all__ = [
    "Alternative",
    "Divergence",
    "Exact",
    "ExpectedGain",
    "InformationWarning",
    "KernelGain",
    "Separation",
    "from_evidence",
    "from_posterior_draws",
    "from_prior_draws",
]
