"""The methods that check each other on one experiment: engines, each with a marginal."""

from typing import Any, NamedTuple

from ..experiment.experiment import Experiment
from . import engines, marginals
from .engines.engine import Engine
from .marginals.marginal import Marginal
from .names import of_name

GRID_UNKNOWNS = 2
"""Most parameters that a grid over the prior is laid for."""

SIZES: dict[str, dict[str, Any]] = {
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
    """One method by the names of its engine and its marginal.

    Raises
    ------
    InputError
        If there is no such engine or marginal.
    """
    return Method(
        f"{marginal} {engine}",
        of_name(engines, engine)(**SIZES.get(engine, {})),
        of_name(marginals, marginal)(**SIZES.get(marginal, {})),
    )


def standard_methods(experiment: Experiment, engine: Engine | None = None) -> list[Method]:
    """Return the methods that suit an experiment; the first is the one to report.

    Parameters
    ----------
    experiment
        The experiment.
    engine
        The engine to report, with latent placement; SMC by default.

    Notes
    -----
    Latent placement by SMC and by NUTS, the paper's kernel density estimate by importance
    sampling, and, where parameters are few, placement integrated by quadrature on a grid of the
    prior.
    """
    reported = method("smc", "latent")
    if engine is not None:
        name = f"latent {type(engine).__name__.lower()}"
        reported = reported._replace(name=name, engine=engine)
    latent = [reported, method("nuts", "latent")]
    parameters = [unknown for unknown in experiment.unknowns if not unknown.is_of_transducer]
    if len(parameters) == len(experiment.unknowns):
        return latent
    fits_grid = len(parameters) <= GRID_UNKNOWNS
    gridded = fits_grid and all(parameter.distribution.shape() == () for parameter in parameters)
    exact = [method("grid", "quadrature")] if gridded else []
    return [*latent, method("importance", "kde"), *exact]
