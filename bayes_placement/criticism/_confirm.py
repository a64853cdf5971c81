"""_confirm: in, a fit and its Laplace approximation; out, draws and evidence by SMC from there.

Not known here: candidates, what is claimed.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._types import InfeasibleError, Key, no_progress
from ..engines import SMC
from ..engines._engine import Draws
from ._descent import Fit
from ._problem import Problem

WIDER = 1.5
"""Standard deviation of the reference over that of Laplace's Gaussian: heavy enough to cover."""

ENGINE = SMC(particles=400, populations=4, moves=10, prior_draws=2)


class Reference:
    """Posterior whose tempering begins at a wide Gaussian about the fit, not at the prior.

    What engines call the prior is that Gaussian; what they call the likelihood is the posterior
    density over it, so that the evidence is that of the model.
    """

    def __init__(self, problem: Problem, fit: Fit):
        self.problem = problem
        self.dimension = problem.dimension
        self.mode = jnp.asarray(fit.point)
        self.root = WIDER * jnp.linalg.cholesky(jnp.asarray(fit.covariance))
        self.log_volume = float(jnp.sum(jnp.log(jnp.diag(self.root))))
        self.constant = 0.5 * np.log(2 * np.pi)

    def log_prior(self, flat: Any) -> Any:
        """Log density of the Gaussian."""
        unit = jax.scipy.linalg.solve_triangular(self.root, flat - self.mode, lower=True)
        return -0.5 * unit @ unit - self.log_volume - self.dimension * self.constant

    def log_likelihood(self, flat: Any) -> Any:
        """Log of the posterior density over that of the Gaussian, not normalised."""
        residual, spread = self.problem.residual(flat, False)
        likelihood = -0.5 * residual @ residual - spread - self.problem.count * self.constant
        prior = -0.5 * flat @ flat - self.dimension * self.constant
        return likelihood + prior - self.log_prior(flat)

    def log_jacobian(self, flat: Any) -> Any:
        """Zero: the vector itself is what is named."""
        return jnp.zeros(())

    def alternatives(self, flat: Any) -> list[Any]:
        """None."""
        return []

    def sample_prior(self, key: Key, draws: int) -> Any:
        """Draws from the Gaussian."""
        return self.mode + jax.random.normal(key, (draws, self.dimension)) @ self.root.T

    def prior_quadrature(
        self, points: int, box: list[tuple[float, float]] | None = None
    ) -> tuple[Any, Any]:
        """Refuse: there is no prior here to lay nodes over."""
        raise InfeasibleError(
            "engines.Grid was asked to confirm a fit, but it needs the prior itself. Use "
            "engines.SMC()."
        )


def confirmed(problem: Problem, fit: Fit, seed: int = 0) -> Draws:
    """Draws of the posterior about a fit, with the log evidence and its standard error."""
    return ENGINE.run(Reference(problem, fit), jax.random.PRNGKey(seed), no_progress)
