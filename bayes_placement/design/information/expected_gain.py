"""expected_gain: in, an experiment with output error; out, what it will teach on the average.

Not known here: where else a transducer could sit.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import logsumexp
from jaxtyping import Array, Float

from ...experiment.experiment import Experiment
from ...inference.alternative_explanation import JointDraws, draws_of
from . import _points
from ._estimator import Estimator, Gain, Plan, deviation, known_noise, placement_laws
from ._knowledge import Posterior, Prior, knowledge, typical
from ._tangents import Kernels

BATCH = 64
"""Draws of the parameters whose responses are computed at once."""


class ExpectedGain(Estimator):
    """Expected information gain: the divergence on the average over data the prior predicts.

    Nested Monte Carlo (Ryan 2003, DOI 10.1198/1061860032012): E{log p(y | h) - log p(y)} over
    simulated data y, with p(y) the mean of p(y | h) over draws of the parameters; too few of them
    make it too high, by about the relative variance of that density over twice their number. The
    placement is integrated by normal kernels about draws of it, each carried on to the outputs
    along its tangent: its error falls with the square of their width, and 16 draws do where a plain
    average over responses would take tens of thousands.

    Parameters
    ----------
    draws, placement_draws
        Draws of the parameters and, for each of them, of the placement, in each replicate.
    data_draws
        Simulated data in each replicate.
    sampling
        `sobol` or `plain`, see `KDE`.
    replicates
        Independent sets of points, whose spread is the error.
    after
        What an earlier measurement told, see `KDE`.
    """

    draws: int = eqx.field(static=True, default=256)
    placement_draws: int = eqx.field(static=True, default=64)
    data_draws: int = eqx.field(static=True, default=256)
    sampling: str = eqx.field(static=True, default="sobol")
    replicates: int = eqx.field(static=True, default=4)
    after: JointDraws | None = eqx.field(default=None, converter=draws_of)

    def typical(self) -> dict[str, np.ndarray]:
        """Means after the earlier measurement."""
        return typical(self.after)

    def plan(self, experiment: Experiment, seed: int, moved: Sequence[str] = ()) -> Plan:
        """Draw all points and return the estimate.

        Raises
        ------
        ValueError
            If there is no output error, or no parameter is unknown.
        """
        known_noise(experiment, "information.ExpectedGain")
        known = knowledge(experiment, self.after, moved)
        # Draws that make the data must not be among those that explain them.
        making, explaining = known.halves() if isinstance(known, Posterior) else (known, known)
        size = jax.eval_shape(lambda: experiment.nominal().predict()).size
        each = known.dimension
        wide = _points.dimension(placement_laws(experiment, known.names))

        def drawn(count: int, wide: int, number: int) -> Array:
            found = _points.scores(self.sampling, self.replicates, count, wide, seed + number)
            return jnp.asarray(found)

        outer = drawn(self.data_draws, each + wide + size, 0)
        inner, places = drawn(self.draws, each, 1), drawn(self.placement_draws, wide, 2)

        def plan(one: Experiment, nominal: dict[str, Any]) -> Gain:
            now = Prior(placement_laws(one, known.names))

            def replicate(several: Any) -> Float[Array, ""]:
                own, parameters, spread = several
                true = _True(
                    making.values(own[:, :each]),
                    own[:, each : each + wide],
                    own[:, each + wide :],
                )
                return _gain(one, now, true, explaining.values(parameters), spread)

            found = jax.lax.map(replicate, (outer, inner, places))
            return Gain(jnp.mean(found), (jnp.sum(found) - found) / (self.replicates - 1))

        return plan


class _True(NamedTuple):
    """What makes the data: parameters by name, scores of places, and errors [data, output]."""

    parameters: dict[str, Any]
    places: Array
    error: Array


def _gain(
    one: Experiment, places: Prior, true: _True, parameters: dict[str, Any], spread: Array
) -> Float[Array, ""]:
    """Mean over simulated data of the log of p(y | h) over p(y)."""
    level = deviation(one)

    def respond(values: dict[str, Any], place: Array) -> Float[Array, "output"]:
        return one.fix(values | places.values(place)).predict().ravel() / level

    y = jax.vmap(respond)(true.parameters, true.places) + true.error

    def log_density(values: dict[str, Any], data: Array) -> Float[Array, "data"]:
        """Log density of data [data, output] for one draw of the parameters."""
        return Kernels.of(lambda place: respond(values, place), spread).log_density(data)

    given = jax.lax.map(
        lambda pair: log_density(pair[0], pair[1][None])[0],
        (true.parameters, y),
        batch_size=BATCH,
    )
    each = jax.lax.map(lambda values: log_density(values, y), parameters, batch_size=BATCH)
    return jnp.mean(given - (logsumexp(each, axis=0) - jnp.log(each.shape[0])))
