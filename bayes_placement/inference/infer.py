"""infer: in, an experiment, a measurement, an engine and a marginal; out, one tree of results.

Not known here: how an engine or a marginal works, how a tree of results is laid out.
"""

import time
import warnings
from typing import Any

import jax
import numpy as np
import xarray as xr

from .._random import jax_key, recorded_seed
from .._sites import Role, substitute
from .._types import InputError, Key, Progress, no_progress
from ..experiment.experiment import Experiment, Measurements
from ..experiment.noise import Data
from . import _results, divergence
from ._target import Target
from .engines import SMC
from .engines._engine import Draws, Engine
from .estimates import Weighting, standard_error
from .marginals import LEAST_NODES, Latent, Marginal
from .simulate import sample_prior
from .symmetries import symmetries

BATCH = 256


class InferenceWarning(UserWarning):
    """A result whose own diagnostics say that it should not be trusted as it stands."""


def infer(
    experiment: Experiment,
    measurement: Measurements,
    *,
    engine: Engine | None = None,
    marginal: Marginal | None = None,
    key: int | Key = 0,
    progress: Progress = no_progress,
) -> xr.DataTree:
    """Posterior of everything unknown in an experiment, given a measurement.

    Parameters
    ----------
    experiment
        Structure, instruments, lines, observation and noise.
    measurement
        Measured FRFs that hold the lines and channels of the experiment; with force levels, one
        measurement for each.
    engine
        `engines.SMC()` by default.
    marginal
        What becomes of the placement: `marginals.Latent()` by default.
    key
        Seed or JAX key; the same key gives the same result, bit for bit, on one machine.
    progress
        Called with the share of the work done.

    Returns
    -------
    xarray.DataTree
        Groups `posterior`, `sample_stats`, `log_likelihood`, `posterior_predictive`,
        `observed_data`, `prior` as ArviZ has them, and `estimates`: figures with standard errors,
        divergence from the prior, log evidence. The attributes carry versions, seed and settings.

    Raises
    ------
    ValueError
        If nothing is unknown, a line or channel was not measured, or the marginal cannot
        integrate this experiment.

    Warns
    -----
    InferenceWarning
        One sentence for each diagnostic that fails, with what to do.
    """
    began = time.perf_counter()
    engine = SMC() if engine is None else engine
    marginal = Latent() if marginal is None else marginal
    _check(experiment)
    data = experiment.data(measurement)
    marginal_key, engine_key, finish_key, prior_key = jax.random.split(jax_key(key), 4)
    laws = {one.name: one.distribution for one in marginal.sampled(experiment)}
    moves = symmetries(experiment) if marginal.samples_placement else ()
    target = Target(marginal.model(experiment, data, marginal_key), laws, moves)
    draws = engine.run(target, engine_key, progress)
    resolve = marginal.placement(experiment, data, marginal_key)
    parents = _results.equal_draws(draws)
    equal = _results.pick(draws.position, parents)
    found = _finish(experiment, data, target, equal, resolve, finish_key)
    found |= {"data": data, "parents": parents, "sampled": _named(target, draws.position)}
    found["divergences"] = _divergences(experiment, target, draws)
    found["mode"] = None if draws.mode is None else target.constrain(draws.mode)
    complaints = [*draws.complaints, *_unresolved(found["stats"])]
    for complaint in complaints:
        warnings.warn(complaint, InferenceWarning, stacklevel=2)
    record = {
        **engine.settings(),
        **marginal.settings(),
        "experiment": str(experiment),
        "seed": recorded_seed(key),
        "complaints": "\n".join(complaints),
        "seconds": time.perf_counter() - began,
    }
    return _results.tree(experiment, draws, found, sample_prior(experiment, prior_key), record)


def _check(experiment: Experiment) -> None:
    if not experiment.unknowns:
        raise InputError(
            "Nothing in this experiment is unknown, so there is nothing to infer. Put a "
            "distribution where a number is not known: damping.Modal([dist.Uniform(0.02, 0.06)])."
        )


def _finish(
    experiment: Experiment, data: Data, target: Target, position: Any, resolve: Any, key: Key
) -> dict[str, Any]:
    """Name the draws, draw integrated placements back, and predict the outputs of each draw."""

    def one(flat: Any, key: Key) -> dict[str, Any]:
        values, stats = target.constrain(flat), {}
        place_key, noise_key = jax.random.split(key)
        if resolve is not None:
            placement, stats = resolve(_with(experiment, values), place_key)
            values = {**values, **placement}
        predicted = _with(experiment, values)
        return {"values": values, "stats": stats, **_predict(predicted, data, noise_key)}

    chains, count = position.shape[:2]
    flat = position.reshape(chains * count, -1)
    keys = jax.random.split(key, chains * count)
    mapped = jax.jit(
        lambda flat, keys: jax.lax.map(lambda pair: one(*pair), (flat, keys), batch_size=BATCH)
    )(flat, keys)
    return jax.tree.map(lambda x: np.asarray(x).reshape(chains, count, *x.shape[1:]), mapped)


def _with(experiment: Experiment, values: dict[str, Any]) -> Experiment:
    return substitute(experiment, values)


def _predict(experiment: Experiment, data: Data, key: Key) -> dict[str, Any]:
    predicted = experiment.predict()
    if experiment.noise is None:
        return {"response": predicted}
    law = experiment.noise.distribution(predicted, data)
    return {
        "response": predicted,
        "replicate": law.sample(key),
        "log_likelihood": law.log_prob(data.z),
    }


def _named(target: Target, position: Any) -> dict[str, np.ndarray]:
    return jax.tree.map(np.asarray, jax.jit(jax.vmap(jax.vmap(target.constrain)))(position))


def _unresolved(stats: dict[str, np.ndarray]) -> list[str]:
    """Complain where the integral over the placement is not resolved."""
    mean = {name: float(np.mean(value)) for name, value in stats.items()}
    complaints = []
    if mean.get("node_ess", np.inf) < LEAST_NODES:
        complaints.append(
            f"The integral over the placement is not resolved: {mean['node_ess']:.1f} nodes carry "
            f"it along a coordinate, where {LEAST_NODES} are needed; use more points or draws, or "
            "marginals.Latent()."
        )
    if mean.get("kernel_over_noise", 0.0) > 1:
        complaints.append(
            f"The kernels of the density estimate are {mean['kernel_over_noise']:.1f} times as "
            "wide as the output error, so this posterior is too broad; more draws narrow them only "
            "slowly, so use marginals.Latent() or marginals.Quadrature()."
        )
    return complaints


def _divergences(
    experiment: Experiment, target: Target, draws: Draws
) -> dict[str, divergence.Divergence]:
    """Divergence from the prior of all sampled unknowns, and of the parameters h alone."""
    unknown = experiment.unknown
    parameters = [name for name in target.transforms if unknown[name].role is Role.PARAMETER]
    whole = _whole_divergence(target, draws)
    if len(parameters) == len(target.transforms):
        return {"all": whole, "parameters": whole}
    nothing = divergence.Divergence(float("nan"), float("nan"))
    if draws.log_weight is not None or not parameters:
        return {"all": whole, "parameters": nothing}
    return {"all": whole, "parameters": _nearest(target, draws, parameters)}


def _whole_divergence(target: Target, draws: Draws) -> divergence.Divergence:
    likelihood = np.asarray(draws.log_likelihood)
    if draws.log_weight is not None:
        weight = np.asarray(draws.log_weight - likelihood).ravel() + draws.log_evidence
        prior = weight if draws.exact else None
        kl, error = divergence.from_prior_draws(likelihood.ravel(), prior)
        return divergence.Divergence(kl, 0.0 if draws.exact else error)
    if draws.lineage is not None:
        mean = float(np.mean(likelihood))
        error = standard_error(likelihood - mean, Weighting(lineage=np.asarray(draws.lineage)))
        return divergence.from_evidence(mean, error, draws.log_evidence, draws.log_evidence_error)
    return _nearest(target, draws, list(target.transforms))


def _nearest(target: Target, draws: Draws, names: list[str]) -> divergence.Divergence:
    places = target.places(names)
    prior = jax.jit(jax.vmap(jax.vmap(lambda flat: target.log_prior(flat, names))))
    vectors = np.asarray(draws.position)[..., places]
    return divergence.from_posterior_draws(vectors, np.asarray(prior(draws.position)))
