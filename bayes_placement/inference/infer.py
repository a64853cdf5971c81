"""Posterior of everything unknown in an experiment, given a measurement."""

import time
from concurrent.futures import Executor

import equinox as eqx
import jax
import numpy as np
import xarray as xr
from jaxtyping import Array, Float

from .._shared.arguments import arguments_checked, check_kind
from .._shared.compiled import compiled
from .._shared.dimensions import Key
from .._shared.errors import InputError, warn
from .._shared.garbage import long_computation
from .._shared.parts import done_by
from .._shared.progress import Progress, no_progress
from .._shared.sites import Role, substitute
from ..experiment.experiment import Experiment, Measurements
from ..experiment.noise import Data
from . import divergence, engines, marginals
from ._results_tree import Inference, equal_draws, pick, tree
from .batches import affordable_batch
from .chi2 import misfit_sentence
from .engines.engine import Draws, Engine, EngineDraws, Flat, Positions
from .estimates import LEAST_NODES, Weighting, standard_error
from .marginals.marginal import DrawPlacement, Marginal
from .names import of_name
from .record import jax_key, origin, recorded_seed
from .results import DATA_FAULTS, MISFIT, RESPONSE_WHEN_EXACT, WARNINGS
from .simulate import sample_prior
from .symmetries import Values, symmetries
from .unconstrained import UnconstrainedModel

Predicted = tuple[Values, Values, Values]

BATCH = 256
"""Draws whose outputs are predicted at once, at most."""


class InferenceWarning(UserWarning):
    """A result whose own diagnostics say that it should not be trusted as it stands."""


@arguments_checked
@long_computation()
def infer(
    experiment: Experiment,
    measurement: Measurements,
    *,
    engine: Engine | str = "smc",
    marginal: Marginal | str = "latent",
    key: int | Key = 0,
    executor: Executor | None = None,
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
        One of `engines`, or its name: `"map"`. `engines.SMC()` by default.
    marginal
        What becomes of the placement: one of `marginals`, or its name; `marginals.Latent()` by
        default.
    key
        Seed or JAX key; the same key gives the same result, bit for bit, on one machine.
    executor
        Any `concurrent.futures.Executor` that does the populations of `engines.SMC`, such as
        `design.workers()` gives, or one of a cluster; by default this process does. The result is
        that of one process with as many cores as a worker has; with more of them sums round
        otherwise. Other engines run in this process.
    progress
        Called with the share of the work done.

    Returns
    -------
    xarray.DataTree
        Groups `posterior`, `sample_stats`, `log_likelihood`, `log_prior`,
        `posterior_predictive`, `observed_data`, `constant_data`, `prior` as ArviZ has them, and
        `estimates`: figures with standard errors,
        divergence from the prior, log evidence. The attributes carry versions, date, seed,
        settings, hashes of experiment and measurement, and two lists of sentences: `warnings`, and
        `data_faults` of the measurement. Where the noise is known and chi2 says that the model
        fails, the attribute `misfit` says so; `check` says where it fails.

    Raises
    ------
    InputError
        If nothing is unknown, a line or channel was not measured, or there is no such engine or
        marginal; `InfeasibleError` if the marginal cannot integrate this experiment.
    WorkerError
        If the executor loses a worker again and again, or takes no more.

    Warns
    -----
    InferenceWarning
        One sentence for each diagnostic that fails, with what to do.

    Examples
    --------
    >>> posterior = bp.infer(experiment, measured, engine=bp.engines.MAP())
    >>> list(posterior["posterior"].data_vars)
    ['structure.damping.ratio', 'sensor.s1.position']
    """
    began = time.perf_counter()
    method = _engine(engine), _marginal(marginal)
    _check(experiment)
    data = experiment.data(measurement)
    faults = experiment.check_data(measurement).sentences()
    with done_by(executor):
        inference = _inference(experiment, data, *method, jax_key(key), progress)
    unresolved = _unresolved(inference.stats)
    sentences = [*inference.draws.warnings, *unresolved]
    for sentence in sentences:
        warn(sentence, InferenceWarning)
    record: dict[str, object] = {
        **method[0].settings(),
        **method[1].settings(),
        **origin(experiment, measurement),
        "experiment": str(experiment),
        "seed": recorded_seed(key),
        WARNINGS: sentences,
        DATA_FAULTS: faults,
        "seconds": time.perf_counter() - began,
    }
    result = tree(inference, record)
    # Where the likelihood is not that of the model, its misfit says nothing about the model.
    misfit = "" if unresolved else misfit_sentence(result)
    result.attrs |= {MISFIT: misfit} if misfit else {}
    return result


def _engine(engine: Engine | str) -> Engine:
    method = of_name(engines, engine)() if isinstance(engine, str) else engine
    needed = "an engine or its name is needed, since it explores the posterior"
    check_kind("engine", method, Engine, needed, "engine=engines.SMC()")
    return method


def _marginal(marginal: Marginal | str) -> Marginal:
    method = of_name(marginals, marginal)() if isinstance(marginal, str) else marginal
    needed = "a marginal or its name is needed, since it says what becomes of the placement"
    check_kind("marginal", method, Marginal, needed, "marginal=marginals.Latent()")
    return method


def _check(experiment: Experiment) -> None:
    if not experiment.unknowns:
        raise InputError(
            "Nothing in this experiment is unknown, so there is nothing to infer. Put a "
            "distribution where a number is not known: damping.Modal([dist.Uniform(0.02, 0.06)])."
        )


def _inference(
    experiment: Experiment,
    data: Data,
    engine: Engine,
    marginal: Marginal,
    key: Key,
    progress: Progress,
) -> Inference:
    """Run the engine, draw integrated placements back and predict the outputs of each draw."""
    marginal_key, engine_key, prediction_key, prior_key = jax.random.split(key, 4)
    posterior = _posterior(experiment, data, marginal, marginal_key)
    draws = engine.run(posterior, engine_key, progress)
    parents = equal_draws(draws)
    draw_placement = marginal.placement(experiment, data, marginal_key)
    constrain = compiled(UnconstrainedModel.constrain)
    values, predictions, stats = _predictions(
        experiment, data, posterior, pick(draws.position, parents), draw_placement, prediction_key
    )
    return Inference(
        experiment=experiment,
        data=data,
        draws=draws,
        parents=parents,
        sampled=_named(posterior, draws.position),
        values=values,
        predictions=predictions,
        stats=stats,
        divergences=_divergences(experiment, posterior, draws),
        mode=None if draws.mode is None else constrain(posterior, draws.mode),
        prior=sample_prior(experiment, prior_key),
    )


def _posterior(
    experiment: Experiment, data: Data, marginal: Marginal, key: Key
) -> UnconstrainedModel:
    """What an engine explores."""
    priors = {unknown.name: unknown.distribution for unknown in marginal.sampled(experiment)}
    moves = symmetries(experiment) if marginal.samples_placement else ()
    return UnconstrainedModel(
        marginal.model(experiment, data, key),
        priors,
        moves,
        jax.tree_util.Partial(type(marginal).least_squares, marginal, experiment, data),
        jax.tree_util.Partial(type(marginal).hierarchy, marginal, experiment, data),
    )


def memory_needed(
    experiment: Experiment,
    measurement: Measurements,
    *,
    engine: Engine | str = "smc",
    marginal: Marginal | str = "latent",
) -> int:
    """Memory [bytes] that an inference needs at least, known before anything is computed."""
    explorer, treatment = _engine(engine), _marginal(marginal)
    _check(experiment)
    data = experiment.data(measurement)
    posterior = _posterior(experiment, data, treatment, jax_key(0))
    explorer.check(posterior.dimension)
    return explorer.working_bytes(posterior)


def _predictions(
    experiment: Experiment,
    data: Data,
    posterior: UnconstrainedModel,
    position: Positions,
    draw_placement: DrawPlacement | None,
    key: Key,
) -> Predicted:
    """Values by name, predicted outputs and statistics of draws of equal weight [chain, draw]."""
    chains, count = position.shape[:2]
    flat = position.reshape(chains * count, -1)
    keys = jax.random.split(key, chains * count)
    predict = Prediction(experiment, data, posterior, draw_placement)
    batch = affordable_batch(compiled(_predicted_once).bound(predict), (flat[0], keys[0]), BATCH)
    predictions = compiled(_predicted)(predict, batch, flat, keys)
    return jax.tree.map(lambda x: np.asarray(x).reshape(chains, count, *x.shape[1:]), predictions)


class Prediction(eqx.Module):
    """Values, outputs and statistics of one vector, see `_predictions`."""

    experiment: Experiment
    data: Data
    posterior: UnconstrainedModel
    draw_placement: DrawPlacement | None

    def __call__(self, flat: Flat, key: Key) -> Predicted:
        """Draw an integrated placement back, and predict the outputs."""
        values = self.posterior.constrain(flat)
        stats: Values = {}
        place_key, noise_key = jax.random.split(key)
        if self.draw_placement is not None:
            substituted = substitute(self.experiment, values)
            placement, stats = self.draw_placement(substituted, place_key)
            values = {**values, **placement}
        placed = substitute(self.experiment, values)
        return values, _outputs(placed, self.data, noise_key), stats


def _predicted_once(predict: Prediction, pair: tuple[Flat, Key]) -> Predicted:
    return predict(*pair)


def _predicted(predict: Prediction, batch: int, flat: Draws, keys: Key) -> Predicted:
    return jax.lax.map(lambda pair: predict(*pair), (flat, keys), batch_size=batch)


def _outputs(experiment: Experiment, data: Data, key: Key) -> Values:
    """Outputs without and with a draw of the output error, and the log likelihood of the data."""
    response = experiment.predict()
    if experiment.noise is None:
        return {"response": response}
    exact: Values = {}
    if experiment.model_error is not None:
        exact = {RESPONSE_WHEN_EXACT: experiment.with_errors(None).predict()}
    distribution = experiment.noise.distribution(response, data)
    return exact | {
        "response": response,
        "replicate": distribution.sample(key),
        "log_likelihood": distribution.log_prob(data.z),
    }


def _named(posterior: UnconstrainedModel, position: Positions) -> Values:
    return jax.tree.map(np.asarray, compiled(_constrained)(posterior, position))


def _constrained(posterior: UnconstrainedModel, position: Positions) -> Values:
    return jax.vmap(jax.vmap(posterior.constrain))(position)


def _unresolved(stats: Values) -> list[str]:
    """Warn where the integral over the placement is not resolved."""
    mean = {name: float(np.mean(value)) for name, value in stats.items()}
    sentences = []
    if mean.get("node_ess", np.inf) < LEAST_NODES:
        sentences.append(
            f"The integral over the placement is not resolved: {mean['node_ess']:.1f} nodes carry "
            f"it along a coordinate, where {LEAST_NODES} are needed; use more nodes or draws, or "
            "marginals.Latent()."
        )
    if mean.get("kernel_over_noise", 0.0) > 1:
        sentences.append(
            f"The kernels of the density estimate are {mean['kernel_over_noise']:.1f} times as "
            "wide as the output error, so this posterior is too broad; more draws narrow them only "
            "slowly, so use marginals.Latent() or marginals.Quadrature()."
        )
    return sentences


def _divergences(
    experiment: Experiment, posterior: UnconstrainedModel, draws: EngineDraws
) -> dict[str, divergence.Divergence]:
    """Divergence from the prior of all sampled unknowns, and of the parameters h alone."""
    roles = {name: experiment.unknown[name].role for name in posterior.priors}
    parameters = [name for name, role in roles.items() if role is Role.PARAMETER]
    total = _total_divergence(posterior, draws)
    if len(parameters) == len(posterior.priors):
        return {"all": total, "parameters": total}
    if draws.log_weight is not None or not parameters:
        unknown = divergence.Divergence(float("nan"), float("nan"))
        return {"all": total, "parameters": unknown}
    return {"all": total, "parameters": _from_neighbours(posterior, draws, parameters)}


def _total_divergence(posterior: UnconstrainedModel, draws: EngineDraws) -> divergence.Divergence:
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
    return _from_neighbours(posterior, draws, list(posterior.priors))


def _from_neighbours(
    posterior: UnconstrainedModel, draws: EngineDraws, names: list[str]
) -> divergence.Divergence:
    places = posterior.places(names)
    log_prior = compiled(_log_priors)(posterior, names, draws.position)
    vectors = np.asarray(draws.position)[..., places]
    return divergence.from_posterior_draws(vectors, np.asarray(log_prior))


def _log_priors(
    posterior: UnconstrainedModel, names: list[str], position: Positions
) -> Float[Array, "chain draw"]:
    return jax.vmap(jax.vmap(lambda flat: posterior.log_prior(flat, names)))(position)
