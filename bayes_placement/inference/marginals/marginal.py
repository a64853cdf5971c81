"""What every marginal is: it makes an experiment and data a NumPyro model for an engine."""

import abc
from collections.abc import Callable

import equinox as eqx
import numpyro
from jaxtyping import Array, Float
from numpyro.distributions import Distribution

from ..._shared.dimensions import Key
from ..._shared.errors import InfeasibleError
from ..._shared.reprs import with_short_repr
from ..._shared.sites import Unknown, realise
from ...experiment.experiment import MEASURED, Experiment
from ...experiment.noise import Data
from ..engines.empirical_bayes import Hierarchy
from ..engines.engine import Settings
from ..engines.least_squares import LeastSquares
from ..residuals import sizes_of
from ..symmetries import Values

Model = Callable[[], None]

Drawn = tuple[Values, Values]

DrawPlacement = Callable[[Experiment, Key], Drawn]
"""Draws one placement given the data, from an experiment whose parameters are numbers and a key.

It returns the placement by name, and how well the integral is resolved: `node_ess` along a
coordinate, and for kernels `kernel_over_noise`.
"""


@with_short_repr
class Marginal(eqx.Module):
    """What becomes of the placement in the likelihood."""

    samples_placement: eqx.AbstractClassVar[bool]

    @abc.abstractmethod
    def integrates(self, unknown: Unknown) -> bool:
        """Tell whether an unknown is taken out of the likelihood here."""

    def sampled(self, experiment: Experiment) -> list[Unknown]:
        """Return the unknowns that are left to the engine."""
        return [unknown for unknown in experiment.unknowns if not self.integrates(unknown)]

    @abc.abstractmethod
    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """NumPyro model whose unknowns are those that an engine is to sample."""

    @abc.abstractmethod
    def placement(self, experiment: Experiment, data: Data, key: Key) -> DrawPlacement | None:
        """How to draw the integrated placement back; None if nothing was integrated."""

    def least_squares(self, experiment: Experiment, data: Data) -> LeastSquares | None:
        """Return the likelihood as a problem of least squares; None where it is none."""
        return None

    def hierarchy(self, experiment: Experiment, data: Data) -> Hierarchy | None:
        """Return the same where errors have unknown sizes; None where none have.

        Raises
        ------
        InfeasibleError
            If they have, and the likelihood is no such problem.
        """
        if sizes_of(experiment):
            raise InfeasibleError(
                f"engines.MAP with marginals.{type(self).__name__} was given a model error of "
                "unknown sizes. Their joint mode with the errors lies at zero and means nothing, "
                "and sizes of greatest evidence need Gaussian noise and a sampled placement: use "
                "marginals.Latent(), or engines.SMC()."
            )
        return None

    def settings(self) -> Settings:
        """Name, sizes and options, which determine the result, for the record."""
        options = {
            f"marginal_{name}": value if isinstance(value, str) else int(value or 0)
            for name, value in vars(self).items()
        }
        return {"marginal": type(self).__name__, **options}


def integrated(marginal: Marginal, experiment: Experiment) -> dict[str, Distribution]:
    """Distributions of the unknowns that a marginal takes out of the likelihood, by name."""
    return {
        unknown.name: unknown.distribution
        for unknown in experiment.unknowns
        if marginal.integrates(unknown)
    }


class IntegratedLikelihood(eqx.Module):
    """Likelihood of an experiment in which only integrated unknowns are still distributions."""

    @abc.abstractmethod
    def log_likelihood(self, experiment: Experiment) -> Float[Array, ""]:
        """Log likelihood, integrated over those unknowns."""

    @abc.abstractmethod
    def draw_placement(self, experiment: Experiment, key: Key) -> Drawn:
        """Draw those unknowns in proportion to their share of it, see `DrawPlacement`."""


class IntegratedModel(eqx.Module):
    """NumPyro model of the unknowns that are not integrated, with a likelihood of its own.

    It is a tree, so that models of one structure with other numbers share compiled functions.
    """

    marginal: Marginal
    """What takes unknowns out of the likelihood."""
    experiment: Experiment
    """The experiment."""
    likelihood: IntegratedLikelihood
    """Likelihood of the experiment, integrated over those unknowns."""

    def __call__(self) -> None:
        """Sample what is not integrated, and weight it by the likelihood."""
        realised = realise(self.experiment, where=lambda u: not self.marginal.integrates(u))
        numpyro.factor(MEASURED, self.likelihood.log_likelihood(realised))


class IntegratingMarginal(Marginal):
    """A marginal with a likelihood of its own, integrated over what it takes out."""

    @abc.abstractmethod
    def likelihood(self, experiment: Experiment, data: Data, key: Key) -> IntegratedLikelihood:
        """Likelihood, integrated over placement."""

    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """Return a model in which only what is not integrated is sampled."""
        return IntegratedModel(self, experiment, self.likelihood(experiment, data, key))

    def placement(self, experiment: Experiment, data: Data, key: Key) -> DrawPlacement:
        """Draw placements in proportion to their share of the likelihood."""
        return self.likelihood(experiment, data, key).draw_placement
