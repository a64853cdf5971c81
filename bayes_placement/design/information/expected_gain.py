"""The expected information gain, averaged over data that the prior predicts."""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import logsumexp
from jaxtyping import Array, Float

from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ...inference.marginals.quadrature import NestedQuadrature, check, nested_nodes
from . import _sampling
from ._kernel_densities import TangentKernels
from ._sampling import IndependentPriors, PosteriorDraws, PriorKnowledge, prior_knowledge
from .estimator import (
    Gain,
    GainAboutParameters,
    Plan,
    Values,
    divergence,
    known_noise,
    mean_over_replicates,
    output_deviation,
    placement_distributions,
    refuse_model_error,
)

BATCH = 64
"""Draws of the parameters whose responses are computed at once."""


class ExpectedGain(GainAboutParameters):
    """Expected information gain: the divergence averaged over data that the prior predicts.

    Nested Monte Carlo (Ryan 2003, DOI 10.1198/1061860032012): E{log p(y | h) - log p(y)} over
    simulated data y, with p(y) the mean of p(y | h) over draws of the parameters; too few of them
    make it too high, by about the relative variance of that density over twice their number. The
    placement is integrated by normal kernels about draws of it, each carried to the outputs along
    its tangent: its error falls with the square of their width, and 16 draws suffice where a plain
    average over responses would take tens of thousands.

    Parameters
    ----------
    draws
        Draws of the parameters, in each replicate.
    placement_draws
        Draws of the placement for each of them.
    data_draws
        Simulated data, in each replicate.
    sampling
        `sobol` or `plain`, see `KernelGain`.
    replicates
        Independent sets of draws, whose spread is the error.
    after
        Posterior of an earlier measurement, see `KernelGain`.

    Examples
    --------
    >>> bp.information.ExpectedGain(draws=128, data_draws=64)
    ExpectedGain(draws=128, data_draws=64)
    """

    draws: int = eqx.field(static=True, default=256)
    placement_draws: int = eqx.field(static=True, default=64)
    data_draws: int = eqx.field(static=True, default=256)

    def plan(self, experiment: Experiment, seed: int, moved: Sequence[str] = ()) -> Plan:
        """Draw all points and return the estimate.

        Raises
        ------
        InputError
            If there is no output error, or no parameter is unknown.
        """
        known_noise(experiment, "information.ExpectedGain")
        knowledge = prior_knowledge(experiment, self.after, moved)
        refuse_model_error(experiment, knowledge.names, "information.ExpectedGain")
        # The draws that simulate data must not be among those of their density.
        data_knowledge = density_knowledge = knowledge
        if isinstance(knowledge, PosteriorDraws):
            data_knowledge, density_knowledge = knowledge.halves()
        outputs = jax.eval_shape(lambda: experiment.nominal().predict()).size
        size = knowledge.dimension
        placed = _sampling.dimension(placement_distributions(experiment, knowledge.names))

        def scores(count: int, dimension: int, number: int) -> Array:
            sizes = (self.replicates, count, dimension)
            return jnp.asarray(_sampling.scores(self.sampling, *sizes, seed + number))

        data = scores(self.data_draws, size + placed + outputs, 0)
        parameters = scores(self.draws, size, 1)
        placements = scores(self.placement_draws, placed, 2)
        return _ExpectedGain(
            data_knowledge, density_knowledge, placed, data, parameters, placements
        )


class _ExpectedGain(eqx.Module):
    """The estimate, from scores [replicate, draw, .] of data, of parameters and of placements."""

    data_knowledge: PriorKnowledge
    density_knowledge: PriorKnowledge
    placed: int = eqx.field(static=True)
    data: Array
    parameters: Array
    placements: Array

    def __call__(self, at: Experiment, nominal: Values) -> Gain:
        """Information gain of an experiment."""
        known = self.data_knowledge.names
        positions = IndependentPriors(placement_distributions(at, known))
        size = self.data_knowledge.dimension

        def replicate(inputs: tuple[Array, Array, Array]) -> Float[Array, ""]:
            data, parameters, placements = inputs
            truth = _Truth(
                self.data_knowledge.values(data[:, :size]),
                data[:, size : size + self.placed],
                data[:, size + self.placed :],
            )
            of_density = self.density_knowledge.values(parameters)
            return _gain(at, positions, truth, of_density, placements)

        scores = (self.data, self.parameters, self.placements)
        return mean_over_replicates(jax.lax.map(replicate, scores))


class _Truth(NamedTuple):
    """Origin of simulated data: parameters by name, scores of placements, errors [data, output]."""

    parameters: dict[str, Array]
    placements: Array
    error: Array


def _gain(
    experiment: Experiment,
    positions: IndependentPriors,
    truth: _Truth,
    parameters: dict[str, Array],
    placements: Array,
) -> Float[Array, ""]:
    """Mean over simulated data of the log of p(y | h) over p(y)."""
    deviation = output_deviation(experiment)

    def respond(values: dict[str, Array], placement: Array) -> Float[Array, "output"]:
        at = experiment.fix(values | positions.values(placement))
        return at.predict().ravel() / deviation

    y = jax.vmap(respond)(truth.parameters, truth.placements) + truth.error

    def log_density(values: dict[str, Array], data: Array) -> Float[Array, "data"]:
        """Log density of data [data, output] for one draw of the parameters."""
        kernels = TangentKernels.of(lambda placement: respond(values, placement), placements)
        return kernels.log_density(data)

    log_likelihood = jax.lax.map(
        lambda pair: log_density(pair[0], pair[1][None])[0], (truth.parameters, y), batch_size=BATCH
    )
    log_densities = jax.lax.map(lambda values: log_density(values, y), parameters, batch_size=BATCH)
    evidence = logsumexp(log_densities, axis=0) - jnp.log(log_densities.shape[0])
    return jnp.mean(log_likelihood - evidence)


INTEGRATED_AT_ONCE = 8
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
        log_likelihood = jax.lax.map(likelihood, flat, batch_size=INTEGRATED_AT_ONCE)
        return divergence(log_likelihood.reshape(self.shape))
