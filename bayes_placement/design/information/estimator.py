"""Estimators of the information gain: their interface, the divergence and its jackknife error."""

import abc
import dataclasses
from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import logsumexp
from jax.typing import ArrayLike
from jaxtyping import Array, Bool, Float

from ..._shared.arguments import check_count, check_fields
from ..._shared.errors import InfeasibleError
from ..._shared.reprs import with_short_repr
from ..._shared.sites import Role
from ...experiment.experiment import Experiment
from ...experiment.noise import Noise
from ...inference.alternative_explanation import JointDraws, draws_of
from ._sampling import Priors, posterior_means


class InformationWarning(UserWarning):
    """An estimate that its draws cannot resolve.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore", bp.information.InformationWarning)
    ...     learnt = bp.information_map(experiment, places, estimator=estimator)
    """


class Gain(NamedTuple):
    """Information gain [nat]: the divergence of the posterior from the prior."""

    estimate: Float[Array, ""]
    """The gain by all draws."""
    jackknife: Float[Array, "replicate"]
    """The estimate without each replicate. Their spread gives its error and, since replicates are
    common to all placements, that of a difference between two of them."""


Values: TypeAlias = dict[str, ArrayLike]
"""Value of each unknown, by name."""

Plan = Callable[[Experiment, Values], Gain]
"""From an experiment whose numbers may be traced, and the nominal value of each unknown.

One that is a tree (`equinox.Module`), whose random points are arrays in it, is compiled once for
all experiments and seeds; a function defined inside another one is compiled anew for each plan.
"""


@with_short_repr
class Estimator(eqx.Module):
    """An estimator of the information gain of an experiment about its parameters."""

    replicates: eqx.AbstractVar[int]

    def __check_init__(self) -> None:
        check_fields(self)
        for field in dataclasses.fields(self):
            if field.type is int:
                line = f"{type(self).__name__}({field.name}=8)"
                check_count(field.name, getattr(self, field.name), 1, line)

    @abc.abstractmethod
    def plan(self, experiment: Experiment, seed: int, moved: Sequence[str] = ()) -> Plan:
        """Draw all random points, which serve every placement, and return the estimate.

        Parameters
        ----------
        experiment
            The experiment.
        seed
            Seed.
        moved
            Names of the transducers that will be moved.

        Raises
        ------
        InputError
            If the estimate is not possible for this experiment.
        """

    @abc.abstractmethod
    def typical(self) -> dict[str, np.ndarray]:
        """Nominal values that are known better than by the prior, by name."""

    def settings(self) -> dict[str, int | float | str]:
        """Name, sizes and options of the estimator."""
        fields = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        plain = {
            name: value for name, value in fields.items() if isinstance(value, int | float | str)
        }
        return {"estimator": type(self).__name__} | plain


class GainAboutParameters(Estimator):
    """An estimator of the gain beyond the prior, or beyond the posterior of earlier data.

    Parameters
    ----------
    sampling
        `sobol` (scrambled, in replicates) or `plain`: independent draws, as in the paper.
    replicates
        Independent sets of draws, whose spread is the error.
    after
        Result of `infer` for an earlier measurement: the map is then the gain by the next one. By
        default only the prior is known.
    """

    sampling: str = eqx.field(static=True, default="sobol", kw_only=True)
    replicates: int = eqx.field(static=True, default=4, kw_only=True)
    after: JointDraws | None = eqx.field(default=None, converter=draws_of, kw_only=True)

    def typical(self) -> dict[str, np.ndarray]:
        """Means after the earlier measurement."""
        return posterior_means(self.after)


def placement_distributions(experiment: Experiment, known: Collection[str] = ()) -> Priors:
    """Distribution of what is no parameter and not known, by name.

    That is each coordinate and angle of the placement, and the model error.
    """
    return {
        unknown.name: unknown.distribution
        for unknown in experiment.unknowns
        if unknown.is_of_transducer or unknown.role is Role.MODEL_ERROR
        if unknown.name not in known
    }


def refuse_model_error(experiment: Experiment, known: Collection[str], estimator: str) -> None:
    """Refuse a model error that is not known, which is no product over transducers, nor small."""
    errors = [unknown.name for unknown in experiment.unknowns if unknown.role is Role.MODEL_ERROR]
    strange = [name for name in errors if name not in known]
    if strange:
        raise InfeasibleError(
            f"{estimator} was given an experiment with a model error ({strange[0]} is unknown); "
            "an exact model is needed, since this estimate integrates over the placement alone. "
            "Use information.KernelGain(), which draws the errors as well, or "
            "experiment.with_model_error(None)."
        )


def divergence(log_likelihood: Float[Array, "replicate draw"]) -> Gain:
    """Eq. (33) over all draws of the prior, and over those of all replicates but one."""
    retained = ~jnp.eye(log_likelihood.shape[0], dtype=bool)
    jackknife = jnp.stack([_divergence(log_likelihood, replicates) for replicates in retained])
    return Gain(_divergence(log_likelihood, jnp.ones(len(retained), bool)), jackknife)


def _divergence(
    log_likelihood: Float[Array, "replicate draw"], replicates: Bool[Array, "replicate"]
) -> Float[Array, ""]:
    log_weight = jnp.where(replicates[:, None], log_likelihood, -jnp.inf)
    count = jnp.sum(replicates) * log_likelihood.shape[1]
    evidence = logsumexp(log_weight)
    share = jnp.exp(log_weight - evidence)
    # Where the likelihood l vanishes, l log l vanishes too.
    mean = jnp.sum(share * jnp.where(share > 0, log_likelihood, 0.0))
    return mean - evidence + jnp.log(count)


def mean_over_replicates(gains: Float[Array, "replicate"]) -> Gain:
    """Mean of the gains of independent replicates, and without each of them."""
    return Gain(jnp.mean(gains), (jnp.sum(gains) - gains) / (gains.size - 1))


def jackknife_error(
    jackknife: Float[np.ndarray, "*placement replicate"],
) -> Float[np.ndarray, "*placement"]:
    """Jackknife standard error from estimates without each replicate, the last axis.

    NaN where these are not finite.
    """
    count = jackknife.shape[-1]
    finite = np.isfinite(jackknife).all(axis=-1)
    variance = np.var(np.where(finite[..., None], jackknife, 0.0), axis=-1)
    return np.where(finite, np.sqrt((count - 1) * variance), np.nan)


def known_noise(experiment: Experiment, estimator: str) -> Noise:
    """Output error, if its level is stated."""
    noise = experiment.noise
    is_unknown = any(unknown.role is Role.OUTPUT_ERROR for unknown in experiment.unknowns)
    if noise is None or is_unknown or noise.reads_measurement:
        stated = "noise=None" if noise is None else f"noise.{type(noise).__name__} of unknown level"
        raise InfeasibleError(
            f"{estimator} was given an experiment with {stated}; the output error of a "
            "measurement to come is needed. Give noise.Gaussian(0.01), or use "
            "information.KernelGain() without any."
        )
    return noise


def output_deviation(experiment: Experiment) -> Float[Array, "output"]:
    """Standard deviation of each output, where the output error is known."""
    assert experiment.noise is not None
    z = jnp.zeros(jax.eval_shape(lambda: experiment.nominal().predict()).shape)
    variance = experiment.noise.distribution(z, None).variance
    return jnp.sqrt(jnp.broadcast_to(variance, z.shape)).ravel()
