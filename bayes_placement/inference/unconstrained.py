"""Prior and likelihood of a NumPyro model over one flat vector without bounds."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float
from numpyro.distributions import Distribution
from numpyro.infer.util import compute_log_probs

from .._types import InputError, Key
from ._quadrature_rules import product_rule
from .coordinates import Coordinates
from .engines.least_squares import LeastSquares
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
    least_squares
        Called for the likelihood as a problem of least squares, None where it is none.

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
        least_squares: Callable[[], LeastSquares | None] = lambda: None,
    ):
        _check_continuous(priors)
        self.model = model
        self.moves = moves
        self.priors = priors
        self.coordinates = Coordinates(priors, standard_normal=False)
        self.dimension = self.coordinates.dimension
        self._least_squares = least_squares

    @property
    def least_squares(self) -> LeastSquares | None:
        """Likelihood as a problem of least squares over the flat vector."""
        return self._least_squares()

    def flatten(self, values: Values) -> Flat:
        """Flat vector of values by name; not finite where a prior excludes a value."""
        return self.coordinates.vector(values)

    def constrain(self, flat: Flat) -> Values:
        """Values by name at a flat vector."""
        return self.coordinates.values(flat)

    def log_jacobian(self, flat: Flat, names: list[str] | None = None) -> Float[Array, ""]:
        """Log volume that (some) values gain per volume of the flat vector."""
        return self.coordinates.log_jacobian(flat, names)

    def log_prior(self, flat: Flat, names: list[str] | None = None) -> Float[Array, ""]:
        """Log prior density of (some of) the flat vector."""
        return self.coordinates.log_prior(flat, names)

    def log_likelihood(self, flat: Flat) -> Float[Array, ""]:
        """Log density of everything that the model observes."""
        terms, trace = compute_log_probs(self.model, (), {}, self.constrain(flat))
        observed = [value for name, value in terms.items() if trace[name]["is_observed"]]
        return sum(observed, jnp.zeros(()))

    def places(self, names: list[str]) -> list[int]:
        """Places of some unknowns in the flat vector."""
        ranges = [self.coordinates.places[name] for name in names]
        return [place for part in ranges for place in range(part.start, part.stop)]

    def symmetric_images(self, flat: Flat) -> list[Flat]:
        """Vectors that may explain the data as well; not finite where a prior excludes one."""
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
