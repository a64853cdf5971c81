"""separation: in, an experiment and explanations of earlier data; out, how well it parts them.

Not known here: how explanations were found, where else a transducer could sit.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import logsumexp
from jaxtyping import Array, Float

from ..._types import InfeasibleError
from ...experiment.experiment import Experiment
from ...inference.alternative_explanation import Alternative
from . import _points
from ._estimator import Estimator, Gain, Plan, deviation, known_noise, placement_laws
from ._knowledge import Posterior, Prior, knowledge
from ._tangents import Kernels, all_of


class Separation(Estimator):
    """Expected information about which of some explanations is right.

    The mutual information of explanation and data, at most the entropy of the explanations'
    probabilities. Data are simulated from draws of each explanation, placement and output error
    included. Their density under each is estimated from other draws: normal kernels about these,
    in the space of the unknowns, of which each is carried on to the outputs along its tangent (one
    kernel as wide as all draws is the criterion of Box and Hill 1967, DOI
    10.1080/00401706.1967.10490441). No estimate of these densities tells more than there is to
    know, so this is a lower bound up to its standard error (Barber and Agakov 2003).

    Parameters
    ----------
    alternatives
        Two explanations at least: `bp.explain(...).alternatives`.
    placement_draws
        Draws that make the density of each explanation, in each replicate.
    data_draws
        Simulated data of each explanation, in each replicate.
    sampling, replicates
        See `KDE`.

    Raises
    ------
    ValueError
        If there are fewer than two explanations.
    """

    alternatives: tuple[Alternative, ...] = eqx.field(default=(), converter=tuple)
    placement_draws: int = eqx.field(static=True, default=64)
    data_draws: int = eqx.field(static=True, default=64)
    sampling: str = eqx.field(static=True, default="sobol")
    replicates: int = eqx.field(static=True, default=4)

    def __check_init__(self) -> None:
        if len(self.alternatives) < 2:
            given = ", ".join(one.name for one in self.alternatives) or "none"
            raise InfeasibleError(
                f"information.Separation was given {given}; at least two explanations are needed, "
                "since one alone is told apart from nothing. Take those that bp.explain leaves, or "
                "information.ExpectedGain(after=posterior) to sharpen parameters."
            )

    def typical(self) -> dict[str, np.ndarray]:
        """None: no nominal response is asked for."""
        return {}

    def plan(self, experiment: Experiment, seed: int, moved: Sequence[str] = ()) -> Plan:
        """Draw all points and return the estimate.

        Raises
        ------
        ValueError
            If there is no output error, or draws of an explanation lack one of its unknowns.
        """
        known_noise(experiment, "information.Separation")
        several = [_Explained.of(one, experiment, moved) for one in self.alternatives]
        points = [
            _drawn(one, self, experiment, seed + 10 * number) for number, one in enumerate(several)
        ]
        weights = np.array([one.probability for one in self.alternatives])
        prior = jnp.asarray(np.log(weights / weights.sum()))

        def plan(one: Experiment, nominal: dict[str, Any]) -> Gain:
            level = deviation(one)

            def replicate(points: Any) -> Float[Array, ""]:
                responses = [own.response(one, level) for own in several]
                pairs = list(zip(responses, points, strict=True))
                laws = [Kernels.of(respond, some.centres) for respond, some in pairs]
                data = [all_of(respond, some.true) + some.error for respond, some in pairs]
                told = [_told(laws, prior, number, y) for number, y in enumerate(data)]
                return jnp.exp(prior) @ jnp.stack(told)

            found = jax.lax.map(replicate, points)
            return Gain(jnp.mean(found), (jnp.sum(found) - found) / (self.replicates - 1))

        return plan


class _Explained(NamedTuple):
    """An explanation in coordinates of mean zero and unit covariance: unknowns, then places."""

    experiment: Experiment
    shapes: dict[str, tuple[int, ...]]
    mean: np.ndarray
    root: np.ndarray
    known: Float[np.ndarray, "draw unknown"]
    wide: int

    @classmethod
    def of(cls, own: Alternative, experiment: Experiment, moved: Sequence[str]) -> "_Explained":
        here = _as_explained(experiment, own.experiment)
        known = knowledge(here, own.draws, moved)
        assert isinstance(known, Posterior)
        flat = np.concatenate([v.reshape(len(v), -1) for v in known.draws.values()], axis=1)
        mean = flat.mean(axis=0)
        left, values, right = np.linalg.svd(flat - mean, full_matrices=False)
        scale = np.sqrt(len(flat))
        shapes = {name: v.shape[1:] for name, v in known.draws.items()}
        wide = _points.dimension(placement_laws(here, known.names))
        root = right.T * values / scale
        return cls(own.experiment, shapes, mean, root, left * scale, wide)

    def response(self, one: Experiment, level: Array) -> Callable[[Array], Array]:
        """Outputs in deviations at a vector of coordinates."""
        here = _as_explained(one, self.experiment)
        places = Prior(placement_laws(here, self.shapes))

        def respond(vector: Float[Array, "coordinate"]) -> Float[Array, "output"]:
            flat = self.mean + self.root @ vector[: self.root.shape[1]]
            values = self._named(flat) | places.values(vector[self.root.shape[1] :])
            return here.fix(values).predict().ravel() / level

        return respond

    def _named(self, flat: Array) -> dict[str, Array]:
        ends = np.cumsum([int(np.prod(shape)) for shape in self.shapes.values()])
        parts = jnp.split(flat, ends[:-1])
        return {n: p.reshape(s) for (n, s), p in zip(self.shapes.items(), parts, strict=True)}


class _Drawn(NamedTuple):
    """Coordinates [replicate, draw, .] of kernels and of what makes data, and errors of these."""

    centres: Array
    true: Array
    error: Array


def _drawn(own: _Explained, sizes: Separation, experiment: Experiment, seed: int) -> _Drawn:
    size = jax.eval_shape(lambda: experiment.nominal().predict()).size
    # Draws that make the data must not be among those that explain them.
    explaining, making = Posterior({"known": own.known}).halves()

    def scores(count: int, dimension: int, number: int) -> np.ndarray:
        return _points.scores(sizes.sampling, sizes.replicates, count, dimension, seed + number)

    def coordinates(half: Posterior, normal: np.ndarray) -> Array:
        return jnp.concatenate([half.values(normal[..., :1])["known"], normal[..., 1:]], axis=-1)

    fit = scores(sizes.placement_draws, 1 + own.wide, 0)
    data = scores(sizes.data_draws, 1 + own.wide + size, 1)
    makes, error = data[..., : 1 + own.wide], data[..., 1 + own.wide :]
    return _Drawn(coordinates(explaining, fit), coordinates(making, makes), jnp.asarray(error))


def _as_explained(one: Experiment, explained: Experiment) -> Experiment:
    """The experiment with the structure and the instruments' effects of an explanation."""
    return eqx.tree_at(
        lambda tree: (tree.structure, tree.instrument_effects),
        one,
        (explained.structure, explained.instrument_effects),
        is_leaf=lambda node: node is one.instrument_effects,
    )


def _told(
    laws: list[Kernels], prior: Array, number: int, y: Float[Array, "data output"]
) -> Float[Array, ""]:
    """Mean log of the probability of the right explanation over what it was before."""
    each = jnp.stack([law.log_density(y) for law in laws])
    return jnp.mean(each[number] - logsumexp(each + prior[:, None], axis=0))
