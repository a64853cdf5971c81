"""Prior and likelihood of a NumPyro model over one flat vector without bounds."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpyro.distributions import Distribution
from numpyro.infer.util import compute_log_probs

from .._shared.compiled import compiled
from .._shared.dimensions import Key
from .._shared.errors import InputError
from ..experiment.prior_draws import prior_draws
from ._quadrature_rules import product_rule
from .coordinates import Coordinates
from .engines.empirical_bayes import Hierarchy
from .engines.engine import Box, Draws, Flat, Nodes, Scalar
from .engines.least_squares import LeastSquares
from .estimates import Given, from_scalars
from .symmetries import Move, Values


def _unknown() -> None:
    """Likelihood of which nothing is known."""


class UnconstrainedModel(eqx.Module):
    """Prior and likelihood of a NumPyro model over unconstrained vectors.

    It is a tree: models of one structure with other numbers share compiled functions, where the
    model, the moves and what tells of least squares are trees as well.

    Whatever the model observes makes the likelihood; unknowns are independent. Moves are maps of
    named values that may lead to an equally good explanation; each keeps volume and is its own
    inverse. `least_squares` is called for the likelihood as such a problem, `hierarchy` for the
    same where errors have unknown sizes; None where there is none.
    """

    model: Callable[[], None]
    names: tuple[str, ...] = eqx.field(static=True)
    distributions: tuple[Distribution, ...]
    moves: tuple[Move, ...]
    find_least_squares: Callable[[], LeastSquares | None]
    find_hierarchy: Callable[[], Hierarchy | None]

    def __init__(
        self,
        model: Callable[[], None],
        priors: dict[str, Distribution],
        moves: tuple[Move, ...] = (),
        least_squares: Callable[[], LeastSquares | None] = _unknown,
        hierarchy: Callable[[], Hierarchy | None] = _unknown,
    ):
        _check_continuous(priors)
        self.model = model
        # A dictionary would come back from a tree in another order.
        self.names, self.distributions = tuple(priors), tuple(priors.values())
        self.moves = moves
        self.find_least_squares = least_squares
        self.find_hierarchy = hierarchy

    @property
    def priors(self) -> dict[str, Distribution]:
        """Prior of each unknown, by name."""
        return dict(zip(self.names, self.distributions, strict=True))

    @property
    def coordinates(self) -> Coordinates:
        """Map between values by name and the flat vector."""
        return Coordinates(self.priors, standard_normal=False)

    @property
    def dimension(self) -> int:
        """Length of the flat vector."""
        return self.coordinates.dimension

    def least_squares(self) -> LeastSquares | None:
        """Likelihood as a problem of least squares over the flat vector."""
        return self.find_least_squares()

    def hierarchy(self) -> Hierarchy | None:
        """The same problem where errors have unknown sizes."""
        return self.find_hierarchy()

    def flatten(self, values: Given) -> Flat:
        """Flat vector of values by name; not finite where a prior excludes a value."""
        return self.coordinates.vector(values)

    def vector(self, values: Given) -> Flat:
        """Flat vector of values by name, arrays as a whole or element by element."""
        try:
            shapes = {name: prior.shape() for name, prior in self.priors.items()}
            named = jax.tree.map(jnp.asarray, from_scalars(shapes, values))
        except KeyError as error:
            raise InputError(
                f"There is no value of {error} to begin with. A value of every unknown is needed, "
                "such as those of a fit: engines.MAP(begin=ledger.steps[-1].values)."
            ) from error
        flat = self.flatten(named)
        for name, place in self.coordinates.places.items():
            if not np.isfinite(np.asarray(flat[place])).all():
                raise InputError(
                    f'"{name}" is to begin at {named[name]}, where its prior has no density. '
                    "Begin within the priors, which print(experiment) lists."
                )
        return flat

    def constrain(self, flat: Flat) -> Values:
        """Values by name at a flat vector."""
        return self.coordinates.values(flat)

    def log_jacobian(self, flat: Flat, names: list[str] | None = None) -> Scalar:
        """Log volume that (some) values gain per volume of the flat vector."""
        return self.coordinates.log_jacobian(flat, names)

    def log_prior(self, flat: Flat, names: list[str] | None = None) -> Scalar:
        """Log prior density of (some of) the flat vector."""
        return self.coordinates.log_prior(flat, names)

    def log_likelihood(self, flat: Flat) -> Scalar:
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

    def sample_prior(self, key: Key, draws: int) -> Draws:
        """Independent draws from the prior."""
        # Samplers by rejection take ten seconds to compile to run fast, and are run once.
        return compiled(_prior_draws).bound(self, effort=0)(jax.random.split(key, draws))

    def prior_quadrature(self, nodes: int, box: Box | None = None) -> Nodes:
        """Gauss nodes over the prior of scalar unknowns, and the logs of their weights.

        The last unknown runs fastest. The box is a part of each prior, by its cumulative
        probabilities; all of it by default.
        """
        values, log_weight = product_rule(self.priors, nodes, box)
        return compiled(_flattened)(self, values), log_weight


def _prior_draws(model: UnconstrainedModel, keys: Key) -> Draws:
    of_unknowns = jax.vmap(lambda key: jax.random.split(key, len(model.names)))(keys)
    return jax.vmap(model.flatten)(prior_draws(model.priors, of_unknowns))


def _flattened(model: UnconstrainedModel, values: Values) -> Draws:
    return jax.vmap(model.flatten)(values)


def _check_continuous(priors: dict[str, Distribution]) -> None:
    for name, prior in priors.items():
        if prior.support.is_discrete:
            raise InputError(
                f'The unknown "{name}" has a discrete distribution, {type(prior).__name__}, which '
                "the engines cannot explore. Sum over it by marginals.Enumeration(), give it "
                "a continuous distribution, or run NumPyro's DiscreteHMCGibbs on experiment.model."
            )
