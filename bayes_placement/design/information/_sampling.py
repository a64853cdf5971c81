"""What is known of the parameters before a measurement, and draws of all that is unknown."""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import ndtr
from jaxtyping import Array
from numpyro.distributions import Distribution
from scipy.special import ndtri

from ..._shared.errors import InputError
from ..._shared.sites import Role, Unknown
from ...experiment.experiment import Experiment
from ...inference.alternative_explanation import JointDraws
from ...inference.coordinates import Coordinates

SAMPLINGS = ("sobol", "plain")
"""Scrambled Sobol points, or independent draws as in the paper."""

Priors: TypeAlias = dict[str, Distribution]

_EDGE = 1e-12  # nearest probability to 0 and 1


def scores(sampling: str, replicates: int, count: int, dimension: int, seed: int) -> np.ndarray:
    """Standard normal scores [replicate, point, unknown].

    Replicates are independent of each other: their spread gives the error of an estimate.
    Sobol points have at most 21,201 coordinates; all further ones are independent draws, which
    leaves the estimate right and its error about that of independent draws.
    """
    check_sampling(sampling)
    random = np.random.default_rng(seed)
    if sampling == "plain" or dimension == 0:
        return random.standard_normal((replicates, count, dimension))
    return np.stack([_sobol(count, dimension, child) for child in random.spawn(replicates)])


def check_sampling(sampling: str) -> None:
    """Refuse a name of no sampling."""
    if sampling not in SAMPLINGS:
        raise InputError(
            f"sampling={sampling!r} was given; {' or '.join(map(repr, SAMPLINGS))} is needed: "
            "quasi-random points, whose error falls faster, or independent draws."
        )


def _sobol(count: int, dimension: int, random: np.random.Generator) -> np.ndarray:
    """Scores [point, unknown] of a scrambled Sobol sequence."""
    from scipy.stats import qmc  # it takes long to import

    sobol = min(dimension, qmc.Sobol.MAXDIM)
    power = int(np.ceil(np.log2(max(count, 2))))
    points = qmc.Sobol(sobol, rng=random).random_base2(power)[:count]
    normal = ndtri(np.clip(points, _EDGE, 1 - _EDGE))
    return np.hstack([normal, random.standard_normal((count, dimension - sobol))])


def values(distributions: Priors, normal: Array | np.ndarray) -> dict[str, Array]:
    """Values by name at scores [..., unknown]; the distributions may be traced."""
    function: Callable[..., dict[str, Array]] = Coordinates(distributions).values
    for _ in range(normal.ndim - 1):
        function = jax.vmap(function)
    return function(normal)


def dimension(distributions: Priors) -> int:
    """Number of scores that the distributions take."""
    return Coordinates(distributions).dimension


def draws_of_replicate(draws: int, replicates: int) -> int:
    """Draws of each replicate."""
    if replicates < 2 or draws // replicates < 2:
        raise InputError(
            f"draws={draws} in replicates={replicates} were given; at least two replicates of two "
            "draws are needed, since their spread gives the error of the estimate: "
            "KernelGain(draws=1000, replicates=4)."
        )
    return draws // replicates


class IndependentPriors(NamedTuple):
    """Distributions of independent unknowns, by name."""

    distributions: Priors

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns of interest."""
        return tuple(self.distributions)

    @property
    def dimension(self) -> int:
        """Number of scores of a point."""
        return dimension(self.distributions)

    def values(self, scores: Array | np.ndarray) -> dict[str, Array]:
        """Values by name at scores [..., score]."""
        return values(self.distributions, scores)


class PosteriorDraws(NamedTuple):
    """Draws of unknowns that depend on each other, by name [draw, ...]."""

    draws: JointDraws

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns of interest."""
        return tuple(self.draws)

    @property
    def dimension(self) -> int:
        """One: the score of a draw is its number."""
        return 1

    def values(self, scores: Array | np.ndarray) -> dict[str, Array]:
        """Values by name at scores [..., 1]."""
        count = len(next(iter(self.draws.values())))
        number = jnp.floor(ndtr(jnp.asarray(scores)[..., 0]) * count).astype(int)
        chosen = jnp.clip(number, 0, count - 1)
        return {name: jnp.asarray(draws)[chosen] for name, draws in self.draws.items()}

    def halves(self) -> tuple["PosteriorDraws", "PosteriorDraws"]:
        """Draws of even and of odd number."""
        even, odd = (
            {name: draws[start::2] for name, draws in self.draws.items()} for start in (0, 1)
        )
        return PosteriorDraws(even), PosteriorDraws(odd)


PriorKnowledge: TypeAlias = IndependentPriors | PosteriorDraws


def prior_knowledge(
    experiment: Experiment, after: JointDraws | None, moved: Sequence[str]
) -> PriorKnowledge:
    """Prior knowledge of the parameters and, after a measurement, of positions that stay.

    A transducer that stays mounted keeps its position, of which the measurement has informed
    together with the parameters, and of which the next one informs as well. So does a model error.
    """
    unknowns = experiment.unknowns
    priors = {
        unknown.name: unknown.distribution for unknown in unknowns if unknown.role is Role.PARAMETER
    }
    if not priors:
        raise InputError(
            "A map of information was asked for, but the structure has no unknown parameter; at "
            "least one is needed, since the information is about it. Declare one: "
            "damping.Modal([dist.Uniform(0.02, 0.06)])."
        )
    if after is None:
        # JAX sorts the names in other dictionaries; scores belong to unknowns by their order.
        return IndependentPriors(OrderedDict(priors))
    missing = [name for name in priors if name not in after]
    if missing:
        raise InputError(
            f"Draws of {', '.join(after)} were given, but the experiment has the unknown "
            f"{missing[0]} as well. Give the posterior of the same structure: "
            "after=bp.infer(experiment, measured)."
        )
    mounted = [
        unknown.name for unknown in unknowns if unknown.name in after and _stays(unknown, moved)
    ]
    return PosteriorDraws({name: after[name] for name in [*priors, *mounted]})


def _stays(unknown: Unknown, moved: Sequence[str]) -> bool:
    """Whether a placement or a model error is the same in the next measurement."""
    if unknown.role is Role.MODEL_ERROR:
        return not set(unknown.path[-1:]) & set(moved)  # the last word is the transducer, if any
    return unknown.is_of_transducer and unknown.owner.name not in moved


def posterior_means(after: JointDraws | None) -> dict[str, np.ndarray]:
    """Mean of each unknown after a measurement; nothing without one."""
    return {name: np.asarray(np.mean(draws, axis=0)) for name, draws in (after or {}).items()}
