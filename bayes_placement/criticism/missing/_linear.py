"""Residuals at a fit, linear in all that is fitted: what is left once they change at some data."""

import math
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

Some: TypeAlias = slice | np.ndarray
"""Numbers of some of the data."""

ALL = slice(None)


class Linear:
    """Residuals and their slopes along unknowns of standard normal priors."""

    def __init__(
        self, residual: Float[np.ndarray, "datum"], slopes: Float[np.ndarray, "unknown datum"]
    ):
        self.residual, self.slopes = residual, slopes
        self._pull, self._squares = slopes @ residual, residual @ residual
        self._curvature = slopes @ slopes.T + np.eye(len(slopes))

    def cost(
        self, residual: Float[np.ndarray, "point some"], data: Some = ALL
    ) -> Float[np.ndarray, "point"]:
        """Half the sum of squares and the prior, once all is fitted to other residuals.

        These replace the residuals of some data; those of all others stay.
        """
        before = self.residual[data]
        pull = (residual - before) @ self.slopes[:, data].T
        squares = np.einsum("pn,pn->p", residual, residual) - before @ before
        return self.cost_with(squares, pull)

    def cost_with(
        self, squares: Float[np.ndarray, "*point"], pull: Float[np.ndarray, "*point unknown"]
    ) -> Float[np.ndarray, "*point"]:
        """Return the same, from what is added to the squares, and to what pulls on unknowns."""
        whole = self._pull + pull
        absorbed = np.sum(whole * self._solved(whole), axis=-1)
        return 0.5 * (self._squares + squares - absorbed)

    def gain(self, residual: Float[np.ndarray, "point some"], data: Some = ALL) -> float:
        """Greatest decrease of the cost by other residuals; least of any where none is finite."""
        without = self.cost(self.residual[None, data], data)[0]
        return float(without - np.nanmin(self.cost(residual, data), initial=np.inf))

    def information(
        self, change: Float[np.ndarray, "point some"], data: Some = ALL
    ) -> Float[np.ndarray, "point point"]:
        """Products of changes of some residuals, less what the unknowns can absorb."""
        pull = change @ self.slopes[:, data].T
        return change @ change.T - pull @ self._solved(pull).T

    def _solved(self, pull: Float[np.ndarray, "*point unknown"]) -> np.ndarray:
        flat = pull.reshape(math.prod(pull.shape[:-1]), pull.shape[-1])  # a model may lack unknowns
        return np.linalg.solve(self._curvature, flat.T).T.reshape(pull.shape)
