"""_estimator: in, an experiment and its nominal values; out, how much is learnt, with its error.

Not known here: how likelihoods are estimated, where else a transducer could sit.
"""

import abc
import dataclasses
from collections.abc import Callable, Collection, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import logsumexp
from jaxtyping import Array, Bool, Float

from ..._sites import Role
from ..._types import InfeasibleError
from ...experiment.experiment import Experiment
from ...experiment.noise import Noise


class InformationWarning(UserWarning):
    """An estimate that its draws cannot resolve."""


class Gain(NamedTuple):
    """Divergence of the posterior from the prior [nat], also with each replicate left out.

    The latter tell the error of it and, since replicates are common to all placements, that of a
    difference between two of them.
    """

    kl: Float[Array, ""]
    without: Float[Array, "replicate"]


Plan = Callable[[Experiment, dict[str, Any]], Gain]
"""From an experiment whose places may be traced, and the nominal value of each unknown."""


class Estimator(eqx.Module):
    """A way to tell how much an experiment will teach about its parameters."""

    replicates: eqx.AbstractVar[int]

    @abc.abstractmethod
    def plan(self, experiment: Experiment, seed: int, moved: Sequence[str] = ()) -> Plan:
        """Draw all points, which serve every placement, and return the estimate.

        Parameters
        ----------
        experiment
            The experiment.
        seed
            Seed.
        moved
            Names of the transducers that will be elsewhere.

        Raises
        ------
        ValueError
            If the estimate is not possible for this experiment.
        """

    @abc.abstractmethod
    def typical(self) -> dict[str, np.ndarray]:
        """Nominal values that are better known than from the prior, by name."""

    def settings(self) -> dict[str, Any]:
        """Name, sizes and options in figures and words."""
        own = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        plain = {name: one for name, one in own.items() if isinstance(one, int | float | str)}
        return {"estimator": type(self).__name__} | plain


def placement_laws(experiment: Experiment, known: Collection[str] = ()) -> dict[str, Any]:
    """Law of each coordinate and angle of the placement that is not known otherwise, by name."""
    return {
        unknown.name: unknown.distribution
        for unknown in experiment.unknowns
        if unknown.is_placement and unknown.name not in known
    }


def divergence(log_likelihood: Float[Array, "replicate draw"]) -> Gain:
    """Eq. (33) over all draws of the prior, and over those of all replicates but one."""
    kept = ~jnp.eye(log_likelihood.shape[0], dtype=bool)
    without = jnp.stack([_divergence(log_likelihood, one) for one in kept])
    return Gain(_divergence(log_likelihood, jnp.ones(len(kept), bool)), without)


def _divergence(
    log_likelihood: Float[Array, "replicate draw"], kept: Bool[Array, "replicate"]
) -> Float[Array, ""]:
    log_weight = jnp.where(kept[:, None], log_likelihood, -jnp.inf)
    count = jnp.sum(kept) * log_likelihood.shape[1]
    evidence = logsumexp(log_weight)
    share = jnp.exp(log_weight - evidence)
    # Where the likelihood vanishes, l log l does too.
    mean = jnp.sum(share * jnp.where(share > 0, log_likelihood, 0.0))
    return mean - evidence + jnp.log(count)


def spread(
    without: Float[np.ndarray, "*placement replicate"],
) -> Float[np.ndarray, "*placement"]:
    """Jackknife standard error from estimates without each replicate, the last axis.

    NaN where these are not finite.
    """
    count = without.shape[-1]
    known = np.isfinite(without).all(axis=-1)
    variance = np.var(np.where(known[..., None], without, 0.0), axis=-1)
    return np.where(known, np.sqrt((count - 1) * variance), np.nan)


def known_noise(experiment: Experiment, who: str) -> Noise:
    """Output error, once it is stated.

    Raises
    ------
    InfeasibleError
        If there is none, if it is unknown, or if only a measurement could tell it.
    """
    noise = experiment.noise
    unknown = any(one.role is Role.OUTPUT_ERROR for one in experiment.unknowns)
    if noise is None or unknown or noise.reads_coherence:
        given = "noise=None" if noise is None else f"noise.{type(noise).__name__} of unknown level"
        raise InfeasibleError(
            f"{who} was given an experiment with {given}; the output error of what is not measured "
            "yet is needed. Give noise.Gaussian(0.01), or use information.KDE() for none."
        )
    return noise


def deviation(experiment: Experiment) -> Float[Array, "output"]:
    """Standard deviation of each output, where the output error is known."""
    assert experiment.noise is not None
    z = jnp.zeros(jax.eval_shape(lambda: experiment.nominal().predict()).shape)
    return jnp.sqrt(
        jnp.broadcast_to(experiment.noise.distribution(z, None).variance, z.shape)
    ).ravel()
