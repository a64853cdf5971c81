"""information: in, an experiment or a posterior; out, how much is learnt about the parameters.

Divergences of posteriors from priors, and what an experiment may be expected to tell before it is
done, one estimator a file. Not known here: where else a transducer could sit.
"""

from ...inference.alternative_explanation import Alternative
from ...inference.divergence import (
    Divergence,
    from_evidence,
    from_posterior_draws,
    from_prior_draws,
)
from ._estimator import InformationWarning
from .exact import Exact
from .expected_gain import ExpectedGain
from .kde import KDE
from .separation import Separation

__all__ = [
    "KDE",
    "Alternative",
    "Divergence",
    "Exact",
    "ExpectedGain",
    "InformationWarning",
    "Separation",
    "from_evidence",
    "from_posterior_draws",
    "from_prior_draws",
]
