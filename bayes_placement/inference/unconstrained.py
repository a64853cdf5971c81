"""Prior and likelihood of a NumPyro model over one flat vector without bounds."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float
from numpyro.distributions import Distribution, biject_to
from numpyro.infer.util import compute_log_probs

from .._types import InputError, Key
from ._quadrature_rules import product_rule
from .symmetries import Move, Values

Flat = Float[Array, "unknown"]


class UnconstrainedModel:
    """Prior and likelihood of a NumPyro model over unconstrained vectors.

    Parameters
    ----------
    model
        The model; whatever it observes makes the likelihood.
    priors
        Prior of each of its unknowns, by site name, independent of each other.
    moves
        Maps of named values that may lead to an equally good explanation; each keeps volume and
        is its own inverse.

    Raises
    ------
    InputError
        If an unknown is discrete.
    """

    def __init__(
        self,
        model: Callable[[], None],
        priors: dict[str, Distribution],
        moves: tuple[Move, ...] = (),
    ):
        _check_continuous(priors)
        self.model = model
        self.moves = moves
        self.priors = priors
        self.transforms = {name: biject_to(prior.support) for name, prior in priors.items()}
        shapes = {
            name: transform.inverse_shape(priors[name].shape())
            for name, transform in self.transforms.items()
        }
        flat, self.unravel = ravel_pytree({name: jnp.zeros(s) for name, s in shapes.items()})
        self.dimension = flat.size

    def flatten(self, values: Values) -> Flat:
        """Flat unconstrained vector of values by name."""
        free = {name: transform.inv(values[name]) for name, transform in self.transforms.items()}
        return ravel_pytree(free)[0]

    def constrain(self, flat: Flat) -> Values:
        """Values by name at an unconstrained vector."""
        free = self.unravel(flat)
        return {name: transform(free[name]) for name, transform in self.transforms.items()}

    def log_jacobian(self, flat: Flat, names: list[str] | None = None) -> Float[Array, ""]:
        """Log volume that (some) values gain per volume of the unconstrained vector."""
        free, values = self.unravel(flat), self.constrain(flat)
        total = jnp.zeros(())
        for name in names or list(self.priors):
            total += jnp.sum(self.transforms[name].log_abs_det_jacobian(free[name], values[name]))
        return total

    def log_prior(self, flat: Flat, names: list[str] | None = None) -> Float[Array, ""]:
        """Log prior density of (some of) the unconstrained vector."""
        values = self.constrain(flat)
        terms = [jnp.sum(self.priors[name].log_prob(values[name])) for name in names or self.priors]
        return sum(terms, self.log_jacobian(flat, names))

    def log_likelihood(self, flat: Flat) -> Float[Array, ""]:
        """Log density of everything that the model observes."""
        terms, trace = compute_log_probs(self.model, (), {}, self.constrain(flat))
        observed = [value for name, value in terms.items() if trace[name]["is_observed"]]
        return sum(observed, jnp.zeros(()))

    def places(self, names: list[str]) -> list[int]:
        """Places of some unknowns in the flat vector."""
        numbered = self.unravel(jnp.arange(self.dimension, dtype=float))
        return [int(place) for name in names for place in jnp.ravel(numbered[name])]

    def symmetric_images(self, flat: Flat) -> list[Flat]:
        """Vectors that may explain the data as well; NaN where a prior excludes one."""
        return [self.flatten(move(self.constrain(flat))) for move in self.moves]

    def sample_prior(self, key: Key, draws: int) -> Float[Array, "draw unknown"]:
        """Independent draws from the prior."""

        def draw(key: Key) -> Flat:
            keys = jax.random.split(key, len(self.priors))
            pairs = zip(self.priors.items(), keys, strict=True)
            return self.flatten({name: prior.sample(own_key) for (name, prior), own_key in pairs})

        return jax.jit(jax.vmap(draw))(jax.random.split(key, draws))

    def prior_quadrature(
        self, nodes: int, box: list[tuple[float, float]] | None = None
    ) -> tuple[Float[Array, "node unknown"], Float[Array, "node"]]:
        """Gauss nodes over the prior of scalar unknowns, and the logs of their weights.

        Parameters
        ----------
        nodes
            Nodes for each unknown; the last unknown runs fastest.
        box
            Part of each prior, by its cumulative probabilities; all of it by default.

        Raises
        ------
        InfeasibleError
            If an unknown is no scalar or its prior cannot be inverted.
        """
        values, log_weight = product_rule(self.priors, nodes, box)
        return jax.jit(jax.vmap(self.flatten))(values), log_weight


def _check_continuous(priors: dict[str, Distribution]) -> None:
    for name, prior in priors.items():
        if prior.support.is_discrete:
            raise InputError(
                f'The unknown "{name}" has a discrete distribution, {type(prior).__name__}, which '
                "the engines cannot move through. Sum over it by marginals.Enumeration(), give it "
                "a continuous distribution, or run NumPyro's DiscreteHMCGibbs on experiment.model."
            )
