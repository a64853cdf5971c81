"""The information gain of the nominal response, the placement integrated by quadrature."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ...inference.marginals.quadrature import NestedQuadrature, check, nested_nodes
from . import _sampling
from ._prior_knowledge import prior_knowledge
from .estimator import (
    Gain,
    GainAboutParameters,
    Plan,
    Values,
    divergence,
    known_noise,
    placement_distributions,
    refuse_model_error,
)

BATCH = 8
"""Draws of the parameters that are integrated at once."""


class Exact(GainAboutParameters):
    """Divergence for the nominal response, the placement integrated by Gauss quadrature.

    The likelihood is that of `marginals.Quadrature`; the parameters are averaged over draws of
    their prior, Eq. (33).

    Parameters
    ----------
    draws
        Draws of the parameters, in all.
    nodes
        Gauss nodes for each coordinate of the placement.
    sampling
        `sobol` or `plain`, see `KernelGain`.
    replicates
        Independent sets of draws, whose spread is the error.
    after
        Posterior of an earlier measurement, see `KernelGain`.

    Examples
    --------
    >>> bp.information.Exact(draws=256, nodes=32)
    Exact(draws=256, nodes=32)
    """

    draws: int = eqx.field(static=True, default=1024)
    nodes: int = eqx.field(static=True, default=64)

    def plan(self, experiment: Experiment, seed: int, moved: Sequence[str] = ()) -> Plan:
        """Draw all points and return the estimate.

        Raises
        ------
        InputError
            If there is no output error, no parameter is unknown, or an effect may couple the
            instruments.
        """
        knowledge = prior_knowledge(experiment, self.after, moved)
        known_noise(experiment, "information.Exact")
        check(experiment, "information.Exact")
        refuse_model_error(experiment, knowledge.names, "information.Exact")
        count = _sampling.draws_of_replicate(self.draws, self.replicates)
        sizes = (self.replicates, count, knowledge.dimension)
        parameters = knowledge.values(_sampling.scores(self.sampling, *sizes, seed))
        return _Exact(self.nodes, (self.replicates, count), parameters)


class _Exact(eqx.Module):
    """The estimate, from draws of the parameters by name [replicate, draw]."""

    nodes: int = eqx.field(static=True)
    shape: tuple[int, int] = eqx.field(static=True)
    parameters: dict[str, Array]

    def __call__(self, at: Experiment, nominal: Values) -> Gain:
        """Information gain of an experiment."""
        z = at.fix(nominal).predict()
        data = Data(z, np.ones(z.shape, dtype=bool))
        placed = placement_distributions(at, self.parameters)
        integrated = NestedQuadrature(data, nested_nodes(at, placed, self.nodes))

        def likelihood(values: dict[str, Array]) -> Float[Array, ""]:
            return integrated.log_likelihood(at.fix(values))

        flat = {n: jnp.reshape(v, (-1, *v.shape[2:])) for n, v in self.parameters.items()}
        log_likelihood = jax.lax.map(likelihood, flat, batch_size=BATCH)
        return divergence(log_likelihood.reshape(self.shape))
