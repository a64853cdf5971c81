"""Placement sampled along with the parameters."""

import equinox as eqx

from ..._shared.dimensions import Key
from ..._shared.sites import Unknown
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ..engines.empirical_bayes import Hierarchy
from ..engines.least_squares import LeastSquares
from ..residuals import Problem, sizes_of
from .marginal import Marginal, Model


class _LatentModel(eqx.Module):
    """NumPyro model of an experiment whose data are given."""

    experiment: Experiment
    data: Data

    def __call__(self) -> None:
        """Run the model of the experiment."""
        self.experiment.model(self.data)


class Latent(Marginal):
    """Sample the placement along with the parameters: exact, for any number of transducers.

    Examples
    --------
    >>> bp.marginals.Latent().settings()
    {'marginal': 'Latent'}
    """

    samples_placement = True

    def integrates(self, unknown: Unknown) -> bool:
        """Nothing is."""
        return False

    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """Return the experiment's own model."""
        return _LatentModel(experiment, data)

    def least_squares(self, experiment: Experiment, data: Data) -> LeastSquares | None:
        """Return the residuals of the experiment, whose noise is Gaussian."""
        if experiment.noise is None or sizes_of(experiment):
            return None
        return Problem(experiment, data, standard_normal=False).squares

    def hierarchy(self, experiment: Experiment, data: Data) -> Hierarchy | None:
        """Return the same where the model error has unknown sizes."""
        return Problem(experiment, data) if sizes_of(experiment) else None

    def placement(self, experiment: Experiment, data: Data, key: Key) -> None:
        """Nothing was integrated."""
        return
