"""_results: in, named draws and their statistics; out, one tree of results, in ArviZ's words.

Not known here: how anything was computed.
"""

from collections.abc import Iterator
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr

from .._sites import Unknown
from ..experiment.experiment import MEASURED, RESPONSE, Experiment
from .engines._engine import Draws
from .estimates import Figures, Weighting, figures, scalars

PACKAGES = ("bayes_placement", "numpyro", "jax", "numpy", "blackjax", "arviz-base")
EQUAL_DRAWS = 1000
"""Draws of equal weight that stand for weighted ones in the posterior."""

PREDICTED_NUMBERS = 5_000_000
"""Most numbers kept in each variable of the posterior predictive."""

Datasets = dict[str, xr.Dataset]


def tree(
    experiment: Experiment,
    draws: Draws,
    found: dict[str, Any],
    prior: dict[str, Any],
    record: dict[str, Any],
) -> xr.DataTree:
    """Lay out the results of one inference."""
    groups = {
        "posterior": named_draws(experiment, found["values"]),
        "sample_stats": _sample_stats(draws, found),
        "log_likelihood": _log_likelihood(experiment, draws, found),
        "posterior_predictive": _predictive(experiment, found),
        "observed_data": _observed(experiment, found["data"]),
        "prior": named_draws(experiment, prior),
        "estimates": _estimates(experiment, draws, found),
    }
    if draws.log_weight is not None:
        weighted = named_draws(experiment, found["sampled"])
        weighted["log_weight"] = (("chain", "draw"), np.asarray(draws.log_weight))
        groups["weighted"] = weighted
    whole = xr.DataTree.from_dict({f"/{name}": group for name, group in groups.items()})
    whole.attrs = record | {f"version_{name}": version(name) for name in PACKAGES}
    return whole


def equal_draws(draws: Draws) -> np.ndarray | None:
    """Places of draws of equal weight (systematic resampling), or None where all are equal."""
    if draws.log_weight is None:
        return None
    cumulative = np.cumsum(np.exp(np.asarray(draws.log_weight).ravel()))
    steps = (np.arange(EQUAL_DRAWS) + 0.5) / EQUAL_DRAWS * cumulative[-1]
    return np.searchsorted(cumulative, steps)


def pick(values: Any, places: np.ndarray | None) -> Any:
    """Take draws [chain, draw, ...] at some places, as one chain; all of them for None."""
    if places is None:
        return values
    return values.reshape(-1, *values.shape[2:])[places][None]


def named_draws(experiment: Experiment, values: dict[str, Any]) -> xr.Dataset:
    """Draws [chain, draw, ...] of the unknowns, in their order, with units and roles."""
    variables = {}
    for unknown in experiment.unknowns:
        if unknown.name in values:
            array = np.asarray(values[unknown.name])
            extra = [f"{unknown.name}_dim_{i}" for i in range(array.ndim - 2)]
            attributes = _attributes(unknown)
            variables[unknown.name] = (("chain", "draw", *extra), array, attributes)
    return _numbered(xr.Dataset(variables))


def _attributes(unknown: Unknown) -> dict[str, str]:
    """What an unknown belongs to and is for, so that a file of results tells it as well."""
    return {
        "units": unknown.unit,
        "role": unknown.role.value,
        "owner": " ".join(word for word in unknown.owner if word),
        "field": unknown.field,
        "component": unknown.component,
    }


def _numbered(dataset: xr.Dataset) -> xr.Dataset:
    # Where nothing is unknown there are no draws to count.
    known = [name for name in ("chain", "draw") if name in dataset.sizes]
    numbers = {name: np.arange(dataset.sizes[name]) for name in known}
    return dataset.assign_coords(numbers)


def outputs(
    experiment: Experiment, variables: dict[str, Any], leading: tuple[str, ...]
) -> xr.Dataset:
    """Arrays of outputs with the names of channels, parts and lines.

    Lines of several force levels follow each other, with `force_level` beside `frequency`.
    """
    parts = ("part",) if experiment.observe.parts > 1 else ()
    dimensions = (*leading, "sensor", "actuator", *parts, "frequency")
    units = {"units": experiment.observe.label}
    dataset = xr.Dataset({n: (dimensions, np.asarray(v), units) for n, v in variables.items()})
    coordinates: dict[str, Any] = {
        "sensor": [channel.label for channel in experiment.sensor_channels],
        "actuator": [channel.label for channel in experiment.actuator_channels],
        "frequency": ("frequency", experiment.lines, {"units": "Hz"}),
    }
    if experiment.line_forces is not None:
        coordinates["force_level"] = ("frequency", experiment.line_forces, {"units": "N"})
    if parts:
        coordinates["part"] = ["real", "imaginary"]
    return dataset.assign_coords(coordinates)


def _observed(experiment: Experiment, data: Any) -> xr.Dataset:
    z = np.where(np.asarray(data.measured), np.asarray(data.z), np.nan)
    variables = {MEASURED: z}
    deviation = None if experiment.noise is None else experiment.noise.deviation(data)
    if deviation is not None:
        variables["deviation"] = np.asarray(deviation)
    omega = 2 * np.pi * experiment.lines
    variables["receptance"] = experiment.observe.receptance(z, omega)
    variables["log_jacobian"] = experiment.observe.log_jacobian(z, omega)
    dataset = outputs(experiment, variables, ())
    dataset["receptance"].attrs["units"] = "m/N"
    dataset["log_jacobian"].attrs["units"] = "1"
    return dataset


def _sample_stats(draws: Draws, found: dict[str, Any]) -> xr.Dataset:
    own = draws.stats | {"log_likelihood_total": draws.log_likelihood}
    picked = {name: pick(np.asarray(value), found["parents"]) for name, value in own.items()}
    stats = picked | found["stats"]
    return _numbered(xr.Dataset({n: (("chain", "draw"), v) for n, v in stats.items()}))


def _log_likelihood(experiment: Experiment, draws: Draws, found: dict[str, Any]) -> xr.Dataset:
    """Log likelihood of each datum given parameters and placement, or of all data at once."""
    pointwise = found.get("log_likelihood")
    if pointwise is not None and pointwise.ndim == found["response"].ndim:
        return _numbered(outputs(experiment, {MEASURED: pointwise}, ("chain", "draw")))
    total = pick(np.asarray(draws.log_likelihood), found["parents"])
    return _numbered(xr.Dataset({MEASURED: (("chain", "draw"), total)}))


def _predictive(experiment: Experiment, found: dict[str, Any]) -> xr.Dataset:
    names = {RESPONSE: "response", MEASURED: "replicate"}
    arrays = {new: found[old] for new, old in names.items() if old in found}
    shape = arrays[RESPONSE].shape
    stride = max(1, int(np.ceil(np.prod(shape) / PREDICTED_NUMBERS)))
    thinned = {name: array[:, ::stride] for name, array in arrays.items()}
    dataset = outputs(experiment, thinned, ("chain", "draw"))
    places = {"chain": np.arange(shape[0]), "draw": np.arange(shape[1])[::stride]}
    return dataset.assign_coords(places)


def _estimates(experiment: Experiment, draws: Draws, found: dict[str, Any]) -> xr.Dataset:
    """Figures of every unknown with standard errors, divergence from the prior, evidence."""
    rows = list(_figure_rows(experiment, draws, found))
    columns = {
        field: ("unknown", np.array([getattr(row, field) for _, _, row in rows]))
        for field in Figures._fields
    }
    roles = [role for _, role, _ in rows]
    names = {"unknown": [name for name, _, _ in rows], "role": ("unknown", roles)}
    dataset = xr.Dataset(columns, coords=names)
    for word, divergence in found["divergences"].items():
        dataset[f"kl_{word}"] = divergence.kl
        dataset[f"kl_{word}_error"] = divergence.error
    dataset["log_evidence"] = draws.log_evidence
    dataset["log_evidence_error"] = draws.log_evidence_error
    for name, value in draws.attributes.items():
        dataset[name] = value
    if found["mode"] is not None:
        modes = dict(_mode_scalars(found["mode"]))
        dataset["mode"] = ("unknown", [modes.get(name, np.nan) for name, _, _ in rows])
    return dataset


def _figure_rows(
    experiment: Experiment, draws: Draws, found: dict[str, Any]
) -> Iterator[tuple[str, str, Figures]]:
    """Name, role and figures of every unknown number."""
    sampled, resolved = found["sampled"], found["values"]
    for unknown in experiment.unknowns:
        name = unknown.name
        engine_drew_it = name in sampled
        values = sampled[name] if engine_drew_it else resolved.get(name)
        weighting = _weighting(draws) if engine_drew_it else _of_resolved(draws, found)
        if values is not None:
            for word, one in scalars(name, values):
                yield word, unknown.role.value, figures(one, weighting)


def _mode_scalars(mode: dict[str, Any]) -> list[tuple[str, float]]:
    pairs = [scalars(name, np.asarray(value)[None, None]) for name, value in mode.items()]
    return [(word, float(values[0, 0])) for several in pairs for word, values in several]


def _weighting(draws: Draws) -> Weighting:
    weight = None if draws.log_weight is None else np.asarray(draws.log_weight)
    lineage = None if draws.lineage is None else np.asarray(draws.lineage)
    return Weighting(weight, lineage, draws.exact)


def _of_resolved(draws: Draws, found: dict[str, Any]) -> Weighting:
    """Weighting of what was drawn back after the engine ran.

    Copies of one weighted draw depend on each other, save on a grid, whose nodes are no draws.
    """
    parents = found["parents"]
    if parents is None:
        return _weighting(draws)
    return Weighting(lineage=np.arange(parents.size)[None] if draws.exact else parents[None])
