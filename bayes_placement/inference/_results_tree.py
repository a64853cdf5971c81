"""The tree of results of one inference, in ArviZ's groups."""

from collections.abc import Iterator
from typing import NamedTuple, TypeVar

import numpy as np
import xarray as xr
from jaxtyping import Array
from numpyro.distributions import Uniform

from .._shared.compiled import compiled
from ..experiment.experiment import MEASURED, RESPONSE, Experiment
from ..experiment.noise import Data
from .divergence import Divergence
from .engines.engine import EngineDraws
from .estimates import Figures, Weighting, figures, scalars
from .record import versions
from .results import CONSTANTS, RESPONSE_WHEN_EXACT, named_draws, numbered, outputs
from .symmetries import Values

Kept = TypeVar("Kept", Array, np.ndarray)

EQUAL_DRAWS = 1000
"""Draws of equal weight that stand for weighted ones in the posterior."""

PREDICTED_NUMBERS = 5_000_000
"""Most numbers kept in each variable of the posterior predictive."""


class Inference(NamedTuple):
    """What one inference computed."""

    experiment: Experiment
    data: Data
    """The experiment and the measured outputs."""
    draws: EngineDraws
    """What the engine returned."""
    parents: np.ndarray | None
    """Place, among weighted draws, of each draw of equal weight; None where all weigh the same."""
    sampled: Values
    """Values [chain, draw, ...] by name at the draws of the engine."""
    values: Values
    """Values [chain, draw, ...] by name of equal weight, with integrated placements drawn back."""
    predictions: Values
    """`response` without output error, and where there is an output error `replicate` and
    `log_likelihood` of each datum, all [chain, draw, ...]."""
    stats: Values
    """How well integrals over the placement are resolved [chain, draw]."""
    divergences: dict[str, Divergence]
    """Divergence from the prior of all unknowns and of the parameters."""
    mode: Values | None
    """Values by name of highest posterior density, where the engine looks for it."""
    prior: Values
    """Draws [chain, draw, ...] from the prior, by name."""


def tree(inference: Inference, record: dict[str, object]) -> xr.DataTree:
    """Lay out the results; the record becomes attributes, with the versions of packages."""
    experiment, draws = inference.experiment, inference.draws
    groups = {
        "posterior": named_draws(experiment, inference.values),
        "sample_stats": _sample_stats(inference),
        "log_likelihood": _log_likelihood(inference),
        "posterior_predictive": _predictive(inference),
        "observed_data": outputs(experiment, {MEASURED: _measured(inference.data)}, ()),
        CONSTANTS: _constants(experiment, inference.data),
        "log_prior": _log_prior(experiment, inference.values),
        "prior": named_draws(experiment, inference.prior),
        "estimates": _estimates(inference),
    }
    if draws.log_weight is not None:
        weighted = named_draws(experiment, inference.sampled)
        weighted["log_weight"] = (("chain", "draw"), np.asarray(draws.log_weight))
        groups["weighted"] = weighted
    result = xr.DataTree.from_dict({f"/{name}": group for name, group in groups.items()})
    result.attrs = record | {f"version_{name}": number for name, number in versions().items()}
    return result


def equal_draws(draws: EngineDraws) -> np.ndarray | None:
    """Places of draws of equal weight (systematic resampling), or None where all are equal."""
    if draws.log_weight is None:
        return None
    cumulative = np.cumsum(np.exp(np.asarray(draws.log_weight).ravel()))
    steps = (np.arange(EQUAL_DRAWS) + 0.5) / EQUAL_DRAWS * cumulative[-1]
    return np.searchsorted(cumulative, steps)


def pick(values: Kept, places: np.ndarray | None) -> Kept:
    """Take draws [chain, draw, ...] at some places, as one chain; all of them for None."""
    if places is None:
        return values
    return values.reshape(-1, *values.shape[2:])[places][None]


def _measured(data: Data) -> np.ndarray:
    return np.where(np.asarray(data.measured), np.asarray(data.z), np.nan)


def _log_prior(experiment: Experiment, values: Values) -> xr.Dataset:
    """Log prior density [chain, draw] of each unknown, for the sensitivity to its prior.

    Priors of one density everywhere are left out, since no power of theirs is another prior.
    """
    variables = {}
    for unknown in experiment.unknowns:
        prior = unknown.distribution
        if unknown.name in values and not isinstance(prior, Uniform):
            density = np.asarray(compiled(type(prior).log_prob)(prior, values[unknown.name]))
            total = density.reshape(*density.shape[:2], -1).sum(axis=-1)
            variables[unknown.name] = (("chain", "draw"), total)
    return numbered(xr.Dataset(variables))


def _constants(experiment: Experiment, data: Data) -> xr.Dataset:
    """What is known of each datum besides its value: noise, receptance, change of variables."""
    z, variables = _measured(data), {}
    deviation = None if experiment.noise is None else experiment.noise.deviation(data)
    if deviation is not None:
        variables["deviation"] = np.asarray(deviation)
    if data.scatter is not None:
        variables["scatter"] = np.asarray(data.scatter)
    omega = 2 * np.pi * np.asarray(experiment.frequency)
    variables["receptance"] = experiment.observe.receptance(z, omega)
    variables["log_jacobian"] = experiment.observe.log_jacobian(z, omega)
    dataset = outputs(experiment, variables, ())
    dataset["receptance"].attrs["units"] = experiment.observe.reference_unit
    dataset["log_jacobian"].attrs["units"] = "1"
    return dataset


def _sample_stats(inference: Inference) -> xr.Dataset:
    draws = inference.draws
    weighted = draws.stats | {"log_likelihood_total": draws.log_likelihood}
    stats: Values = {name: pick(np.asarray(v), inference.parents) for name, v in weighted.items()}
    stats |= inference.stats
    return numbered(xr.Dataset({n: (("chain", "draw"), v) for n, v in stats.items()}))


def _log_likelihood(inference: Inference) -> xr.Dataset:
    """Log likelihood of each datum given parameters and placement, or of all data at once."""
    predictions = inference.predictions
    pointwise = predictions.get("log_likelihood")
    if pointwise is not None and pointwise.ndim == predictions["response"].ndim:
        return numbered(outputs(inference.experiment, {MEASURED: pointwise}, ("chain", "draw")))
    total = pick(np.asarray(inference.draws.log_likelihood), inference.parents)
    return numbered(xr.Dataset({MEASURED: (("chain", "draw"), total)}))


def _predictive(inference: Inference) -> xr.Dataset:
    names = {RESPONSE: "response", MEASURED: "replicate", RESPONSE_WHEN_EXACT: RESPONSE_WHEN_EXACT}
    predictions = inference.predictions
    arrays = {new: predictions[old] for new, old in names.items() if old in predictions}
    shape = arrays[RESPONSE].shape
    stride = max(1, int(np.ceil(np.prod(shape) / PREDICTED_NUMBERS)))
    thinned = {name: array[:, ::stride] for name, array in arrays.items()}
    dataset = outputs(inference.experiment, thinned, ("chain", "draw"))
    places = {"chain": np.arange(shape[0]), "draw": np.arange(shape[1])[::stride]}
    return dataset.assign_coords(places)


def _estimates(inference: Inference) -> xr.Dataset:
    """Figures of every unknown with standard errors, divergence from the prior, evidence."""
    draws, rows = inference.draws, list(_figure_rows(inference))
    columns = {
        field: ("unknown", np.array([getattr(row.figures, field) for row in rows]))
        for field in Figures._fields
    }
    names, roles = [row.name for row in rows], [row.role for row in rows]
    dataset = xr.Dataset(columns, coords={"unknown": names, "role": ("unknown", roles)})
    for word, divergence in inference.divergences.items():
        dataset[f"kl_{word}"] = divergence.kl
        dataset[f"kl_{word}_error"] = divergence.error
    dataset["log_evidence"] = draws.log_evidence
    dataset["log_evidence_error"] = draws.log_evidence_error
    for name, value in draws.attributes.items():
        dataset[name] = value
    if inference.mode is not None:
        mode = dict(_mode_scalars(inference.mode))
        dataset["mode"] = ("unknown", [mode.get(name, np.nan) for name in names])
    return dataset


class _FigureRow(NamedTuple):
    """Figures of one unknown number."""

    name: str
    role: str
    figures: Figures


def _figure_rows(inference: Inference) -> Iterator[_FigureRow]:
    for unknown in inference.experiment.unknowns:
        if unknown.name in inference.sampled:
            values, weighting = inference.sampled[unknown.name], _weighting(inference.draws)
        elif unknown.name in inference.values:
            values, weighting = inference.values[unknown.name], _weighting_drawn_back(inference)
        else:
            continue
        for name, scalar in scalars(unknown.name, values):
            yield _FigureRow(name, unknown.role.value, figures(scalar, weighting))


def _mode_scalars(mode: Values) -> Iterator[tuple[str, float]]:
    for name, value in mode.items():
        for word, scalar in scalars(name, np.asarray(value)[None, None]):
            yield word, float(scalar[0, 0])


def _weighting(draws: EngineDraws) -> Weighting:
    weight = None if draws.log_weight is None else np.asarray(draws.log_weight)
    lineage = None if draws.lineage is None else np.asarray(draws.lineage)
    return Weighting(weight, lineage, draws.exact)


def _weighting_drawn_back(inference: Inference) -> Weighting:
    """Weighting of placements that were drawn back after the engine ran.

    Copies of one weighted draw depend on each other, save on a grid, whose nodes are no draws.
    """
    parents = inference.parents
    if parents is None:
        return _weighting(inference.draws)
    independent = np.arange(parents.size)
    return Weighting(lineage=(independent if inference.draws.exact else parents)[None])
