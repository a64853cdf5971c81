"""Draws of everything unknown from the prior, and what would be measured."""

import numpy as np
import xarray as xr
from numpyro.infer import Predictive

from .._shared.arguments import arguments_checked, check_count
from .._shared.compiled import compiled
from .._shared.dimensions import Key
from .._shared.garbage import long_computation
from ..experiment.experiment import MEASURED, RESPONSE, Experiment
from ..experiment.prior_draws import draws_from_priors
from .record import jax_key
from .results import named_draws, numbered, outputs
from .symmetries import Values

PRIOR_DRAWS = 1000


def sample_prior(experiment: Experiment, key: Key, draws: int = PRIOR_DRAWS) -> Values:
    """Draws [chain, draw, ...] of every unknown from its prior, by name."""
    drawn = draws_from_priors(experiment.unknowns, key, draws)
    return {name: values[None] for name, values in drawn.items()}


@arguments_checked
@long_computation()
def simulate(experiment: Experiment, *, draws: int = 1000, key: int | Key = 0) -> xr.DataTree:
    """Draw everything unknown from its prior, and the outputs that follow.

    Parameters
    ----------
    experiment
        Structure, instruments, lines, observation and noise.
    draws
        Number of draws.
    key
        Seed or JAX key.

    Returns
    -------
    xarray.DataTree
        `prior`: the unknowns. `prior_predictive`: `response` (without output error) and
        `measured` (with it, where the experiment has a noise).

    Examples
    --------
    >>> simulated = bp.simulate(experiment, draws=20)
    >>> simulated["prior_predictive"]["measured"].sizes["draw"]
    20
    """
    check_count("draws", draws, 1, "bp.simulate(experiment, draws=1000)")
    samples = compiled(_simulated)(experiment, draws, jax_key(key))
    drawn = {name: np.asarray(value)[None] for name, value in samples.items()}
    predicted = {name: drawn[name] for name in (RESPONSE, MEASURED) if name in drawn}
    groups = {
        "/prior": named_draws(experiment, drawn),
        "/prior_predictive": numbered(outputs(experiment, predicted, ("chain", "draw"))),
    }
    return xr.DataTree.from_dict(groups)


def _simulated(experiment: Experiment, draws: int, key: Key) -> Values:
    return Predictive(experiment.model, num_samples=draws, batch_ndims=1)(key)
