"""methods: in, an experiment and a measurement; out, its posterior by several methods.

The methods that check each other. Not known here: files, figures, the terminal.
"""

from collections.abc import Callable
from typing import NamedTuple

from ..experiment.experiment import Experiment
from .engines import MAP, NUTS, SMC, Grid, Importance
from .engines._engine import Engine
from .marginals import KDE, Latent, Marginal, Quadrature

GRID_UNKNOWNS = 2
"""Most parameters that a grid over the prior is laid for."""


class Method(NamedTuple):
    """An engine and what it does with the placement."""

    name: str
    engine: Engine
    marginal: Marginal


ENGINES: dict[str, Callable[[], Engine]] = {
    "importance": lambda: Importance(draws=4000),
    "grid": lambda: Grid(points=24),
    "map": MAP,
    "nuts": NUTS,
    "smc": SMC,
}
MARGINALS: dict[str, Callable[[], Marginal]] = {
    "latent": Latent,
    "quadrature": lambda: Quadrature(points=128),
    "kde": KDE,
}


def method(engine: str, marginal: str) -> Method:
    """One method by the names of its engine and its marginal."""
    return Method(f"{marginal} {engine}", ENGINES[engine](), MARGINALS[marginal]())


def standard(experiment: Experiment, engine: Engine | None = None) -> list[Method]:
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
    own = SMC() if engine is None else engine
    name = f"latent {type(own).__name__.lower()}"
    latent = [Method(name, own, Latent()), method("nuts", "latent")]
    if not any(one.is_placement for one in experiment.unknowns):
        return latent
    parameters = [one for one in experiment.unknowns if not one.is_placement]
    few = len(parameters) <= GRID_UNKNOWNS and all(
        one.distribution.shape() == () for one in parameters
    )
    several = [*latent, method("importance", "kde")]
    return [*several, method("grid", "quadrature")] if few else several
