"""Expected information about which of several alternative models of earlier data is right."""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import logsumexp
from jaxtyping import Array, Float

from ..._shared.arguments import check_annotated
from ..._shared.errors import InputError
from ...experiment.experiment import Experiment
from ...inference.alternative_explanation import Alternative
from . import _sampling
from ._kernel_densities import TangentKernels, responses
from ._sampling import IndependentPriors, PosteriorDraws, prior_knowledge
from .estimator import (
    Estimator,
    Gain,
    Plan,
    Values,
    known_noise,
    mean_over_replicates,
    output_deviation,
    placement_distributions,
)


def _tuple_of(alternatives: Sequence[Alternative]) -> tuple[Alternative, ...]:
    check_annotated("alternatives", alternatives, Sequence[Alternative])
    return tuple(alternatives)


class Separation(Estimator):
    """Expected information about which of several explanations is right.

    The mutual information of explanation and data, at most the entropy of the explanations'
    probabilities. Data are simulated from draws of each explanation, placement and output error
    included. Their density under each is estimated from other draws: normal kernels about these,
    in the space of the unknowns, of which each is carried to the outputs along its tangent (one
    kernel as wide as all draws is the criterion of Box and Hill 1967, DOI
    10.1080/00401706.1967.10490441). By any estimate of these densities this is a
    lower bound up to its standard error (Barber and Agakov 2003).

    Parameters
    ----------
    alternatives
        Two explanations at least: `bp.explain(...).alternatives`.
    draws
        Draws for the density of each explanation, in each replicate.
    data_draws
        Simulated data of each explanation, in each replicate.
    sampling, replicates
        See `KernelGain`.

    Raises
    ------
    InputError
        If there are fewer than two explanations.

    Examples
    --------
    >>> as_drawn = bp.information.Alternative("as drawn", 0.5, experiment, posterior)
    >>> late = bp.information.Alternative("late", 0.5, experiment, posterior)
    >>> bp.information.Separation((as_drawn, late), draws=32).draws
    32
    """

    alternatives: tuple[Alternative, ...] = eqx.field(default=(), converter=_tuple_of)
    draws: int = eqx.field(static=True, default=64)
    data_draws: int = eqx.field(static=True, default=64)
    sampling: str = eqx.field(static=True, default="sobol")
    replicates: int = eqx.field(static=True, default=4)

    def __check_init__(self) -> None:
        _sampling.check_sampling(self.sampling)
        if len(self.alternatives) < 2:
            names = ", ".join(alternative.name for alternative in self.alternatives) or "none"
            raise InputError(
                f"information.Separation was given {names}; at least two explanations are needed, "
                "since their separation is estimated. Take bp.explain(...).alternatives, or, for "
                "parameters of one explanation, information.ExpectedGain(after=posterior)."
            )

    def typical(self) -> dict[str, np.ndarray]:
        """None: no nominal response is needed."""
        return {}

    def plan(self, experiment: Experiment, seed: int, moved: Sequence[str] = ()) -> Plan:
        """Draw all points and return the estimate.

        Raises
        ------
        InputError
            If there is no output error, or draws of an explanation lack one of its unknowns.
        """
        known_noise(experiment, "information.Separation")
        explained = [
            _Explanation.of(alternative, experiment, moved) for alternative in self.alternatives
        ]
        points = [
            _points(known, explanation.placed, self, experiment, seed + 10 * number)
            for number, (explanation, known) in enumerate(explained)
        ]
        weights = np.array([alternative.probability for alternative in self.alternatives])
        log_prior = jnp.asarray(np.log(weights / weights.sum()))
        return _Separation([explanation for explanation, _ in explained], points, log_prior)


class _Separation(eqx.Module):
    """The estimate, from points of each explanation and the logs of their probabilities."""

    explanations: list["_Explanation"]
    points: list["_Points"]
    log_prior: Array

    def __call__(self, at: Experiment, nominal: Values) -> Gain:
        """Information gain of an experiment."""
        deviation = output_deviation(at)

        def replicate(points: list[_Points]) -> Float[Array, ""]:
            pairs = [
                (explanation.response(at, deviation), sample)
                for explanation, sample in zip(self.explanations, points, strict=True)
            ]
            densities = [TangentKernels.of(respond, sample.centres) for respond, sample in pairs]
            data = [responses(respond, sample.truth) + sample.error for respond, sample in pairs]
            gains = [_gain(densities, self.log_prior, number, y) for number, y in enumerate(data)]
            return jnp.exp(self.log_prior) @ jnp.stack(gains)

        return mean_over_replicates(jax.lax.map(replicate, self.points))


class _Explanation(NamedTuple):
    """An explanation in coordinates of mean zero and unit covariance: unknowns, then placement."""

    experiment: Experiment
    """Experiment with the effects of the explanation."""
    shapes: OrderedDict[str, tuple[int, ...]]  # JAX sorts the names in other dictionaries
    """Shape of each unknown, by name."""
    mean: Float[np.ndarray, "unknown"]
    root: Float[np.ndarray, "unknown coordinate"]
    """Mean of the draws [unknown], and a root of their covariance [unknown, coordinate]."""
    placed: int
    """Number of coordinates of the placement."""

    @classmethod
    def of(
        cls, alternative: Alternative, experiment: Experiment, moved: Sequence[str]
    ) -> tuple["_Explanation", Float[np.ndarray, "draw coordinate"]]:
        """Return an explanation, and its draws in coordinates."""
        explained = _with_explanation(experiment, alternative.experiment)
        knowledge = prior_knowledge(explained, alternative.draws, moved)
        assert isinstance(knowledge, PosteriorDraws)
        draws = knowledge.draws
        flat = np.concatenate([v.reshape(len(v), -1) for v in draws.values()], axis=1)
        mean = flat.mean(axis=0)
        scores, singular, directions = np.linalg.svd(flat - mean, full_matrices=False)
        scale = np.sqrt(len(flat))
        shapes = OrderedDict((name, v.shape[1:]) for name, v in draws.items())
        placed = _sampling.dimension(placement_distributions(explained, knowledge.names))
        root = directions.T * singular / scale
        return cls(alternative.experiment, shapes, mean, root, placed), scores * scale

    def response(self, at: Experiment, deviation: Array) -> Callable[[Array], Array]:
        """Outputs in deviations at a vector of coordinates."""
        explained = _with_explanation(at, self.experiment)
        positions = IndependentPriors(placement_distributions(explained, self.shapes))
        size = self.root.shape[1]

        def respond(vector: Float[Array, "coordinate"]) -> Float[Array, "output"]:
            flat = self.mean + self.root @ vector[:size]
            values = self._named(flat) | positions.values(vector[size:])
            return explained.fix(values).predict().ravel() / deviation

        return respond

    def _named(self, flat: Array) -> dict[str, Array]:
        ends = np.cumsum([int(np.prod(shape)) for shape in self.shapes.values()])
        values = jnp.split(flat, ends[:-1])
        return {n: p.reshape(s) for (n, s), p in zip(self.shapes.items(), values, strict=True)}


class _Points(NamedTuple):
    """Coordinates [replicate, draw, .] of kernels and of simulated data, and errors of the data."""

    centres: Array
    truth: Array
    error: Array


def _points(
    known: Float[np.ndarray, "draw coordinate"],
    placed: int,
    sizes: Separation,
    experiment: Experiment,
    seed: int,
) -> _Points:
    """Points of an explanation, from its draws in coordinates."""
    outputs = jax.eval_shape(lambda: experiment.nominal().predict()).size
    # The draws that simulate data must not be among those of their density.
    density_draws, data_draws = PosteriorDraws({"known": known}).halves()

    def scores(count: int, dimension: int, number: int) -> np.ndarray:
        return _sampling.scores(sizes.sampling, sizes.replicates, count, dimension, seed + number)

    def coordinates(half: PosteriorDraws, normal: np.ndarray) -> Array:
        return jnp.concatenate([half.values(normal[..., :1])["known"], normal[..., 1:]], axis=-1)

    size = 1 + placed
    centres = coordinates(density_draws, scores(sizes.draws, size, 0))
    data = scores(sizes.data_draws, size + outputs, 1)
    truth = coordinates(data_draws, data[..., :size])
    return _Points(centres, truth, jnp.asarray(data[..., size:]))


def _with_explanation(experiment: Experiment, explained: Experiment) -> Experiment:
    """The experiment with the structure and the instruments' effects of an explanation."""
    return eqx.tree_at(
        lambda tree: (tree.structure, tree.instrument_effects),
        experiment,
        (explained.structure, explained.instrument_effects),
        is_leaf=lambda node: node is experiment.instrument_effects,
    )


def _gain(
    densities: list[TangentKernels], log_prior: Array, number: int, y: Float[Array, "data output"]
) -> Float[Array, ""]:
    """Mean log of the posterior over the prior probability of the right explanation."""
    terms = jnp.stack([density.log_density(y) for density in densities])
    return jnp.mean(terms[number] - logsumexp(terms + log_prior[:, None], axis=0))
