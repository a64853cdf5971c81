"""The methods that check each other on one experiment: engines, each with a marginal."""

from collections.abc import Sequence
from typing import NamedTuple

from .._shared.errors import InfeasibleError
from ..experiment.experiment import Experiment, Measurements
from . import engines, marginals
from .batches import available_bytes
from .engines.engine import Engine
from .infer import memory_needed
from .marginals.marginal import Marginal
from .names import of_name

GRID_UNKNOWNS = 2
"""Most parameters that a grid over the prior is laid for."""

SIZES: dict[str, dict[str, int]] = {
    "smc": {"particles": 1000},
    "importance": {"draws": 4000},
    "grid": {"nodes": 24},
    "quadrature": {"nodes": 128},
}
"""Sizes of engines and marginals in a cross-check, where these are not their defaults."""


class Method(NamedTuple):
    """An engine and what it does with the placement."""

    name: str
    engine: Engine
    marginal: Marginal


def method(engine: str, marginal: str) -> Method:
    """One method by the names of its engine and its marginal."""
    return Method(
        f"{marginal} {engine}",
        of_name(engines, engine)(**SIZES.get(engine, {})),
        of_name(marginals, marginal)(**SIZES.get(marginal, {})),
    )


def standard_methods(experiment: Experiment, engine: Engine | None = None) -> list[Method]:
    """Return the methods that suit an experiment; the first is the one to report.

    Notes
    -----
    Latent placement by SMC and by NUTS, which stops itself where it cannot mix; the paper's kernel
    density estimate by importance sampling; and, where parameters are few, placement integrated by
    quadrature on a grid of the prior, which takes longest.
    """
    reported = method("smc", "latent")
    if engine is not None:
        name = f"latent {type(engine).__name__.lower()}"
        reported = reported._replace(name=name, engine=engine)
    chains = method("nuts", "latent")
    parameters = [unknown for unknown in experiment.unknowns if not unknown.is_of_transducer]
    if len(parameters) == len(experiment.unknowns):
        return [reported, chains]
    fits_grid = len(parameters) <= GRID_UNKNOWNS
    gridded = fits_grid and all(parameter.distribution.shape() == () for parameter in parameters)
    exact = [method("grid", "quadrature")] if gridded else []
    return [reported, chains, method("importance", "kde"), *exact]


class Feasible(NamedTuple):
    """Methods that can treat an experiment on this machine, and why the others cannot."""

    methods: list[Method]
    """Those that can, in their order."""
    left_out: list[str]
    """A sentence on each of the others."""


def feasible(
    methods: Sequence[Method], experiment: Experiment, measurement: Measurements
) -> Feasible:
    """Look, before anything is computed, which methods can treat an experiment."""
    able, left_out = [], []
    for candidate in methods:
        reason = _obstacle(candidate, experiment, measurement)
        if reason:
            left_out.append(f"{candidate.name} is left out: {reason}")
        else:
            able.append(candidate)
    return Feasible(able, left_out)


def _obstacle(candidate: Method, experiment: Experiment, measurement: Measurements) -> str:
    """Why a method cannot be used; empty where it can."""
    try:
        needed = memory_needed(
            experiment, measurement, engine=candidate.engine, marginal=candidate.marginal
        )
    except InfeasibleError as error:
        return str(error)
    free = available_bytes()
    if free is not None and needed > free:
        return (
            f"a single evaluation needs up to {needed / 2**30:.2g} GiB of memory, of which "
            f"{free / 2**30:.2g} GiB are free. Take fewer lines, or fewer nodes or draws."
        )
    return ""
