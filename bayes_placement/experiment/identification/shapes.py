"""The shape of a mode from its residues: a product of shape and participation, with its errors."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float
from scipy.special import chdtrc

ROUNDS = 30
"""Rounds of alternating least squares."""

CHANCE = 0.01
"""Probability below which residues are no product, but for chance."""


class ShapeFit(NamedTuple):
    """Complex shape of a mode at the channels of one side."""

    shape: Complex[np.ndarray, "channel"]
    """The shape, of any scale and phase."""
    of_residues: Complex[np.ndarray, "channel pair"]
    """What each residue that was measured contributes to it, to first order."""
    squares: float
    freedom: int
    """Sum of |residue - product|^2 over their variances, and its complex degrees of freedom."""

    def excess(self, level: float) -> float:
        """Variance of residues about the product over a level; 1 where errors of these explain it.

        Residues are few: what chance explains, at 1 in 100, is none.
        """
        chance = chdtrc(2 * self.freedom, 2 * self.squares / level) if self.freedom > 0 else 1.0
        return self.squares / self.freedom / level if chance < CHANCE else 1.0


def shape_of(
    residue: Complex[np.ndarray, "pair"],
    variance: Float[np.ndarray, "pair"],
    measured: Bool[np.ndarray, "channel other"],
) -> ShapeFit:
    """Fit residues [channel, other] by a product of a number for each channel of either side.

    The product has no scale of its own: the change of least size is that which the residues tell.
    Residues and variances are those of the pairs that were measured.
    """
    rows, columns = np.nonzero(measured)
    table, weight = np.zeros(measured.shape, complex), np.zeros(measured.shape)
    table[measured], weight[measured] = residue, 1 / variance
    other = np.linalg.svd(table)[2][0]
    for _ in range(ROUNDS):
        shape = _shares(table, weight, other)
        other = _shares(table.T, weight.T, shape)
    product = np.zeros((residue.size, sum(measured.shape)), complex)
    pairs = np.arange(residue.size)
    product[pairs, rows] = other[columns]
    product[pairs, len(measured) + columns] = shape[rows]
    root = np.sqrt(1 / variance)
    inverse = np.linalg.pinv(root[:, None] * product) * root
    left = np.abs(residue - shape[rows] * other[columns]) ** 2
    used = measured.any(axis=1).sum() + measured.any(axis=0).sum() - 1
    return ShapeFit(
        shape, inverse[: len(measured)], float(np.sum(left / variance)), residue.size - int(used)
    )


def _shares(table: np.ndarray, weight: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Numbers of the rows of least squares, those of the columns being known; 0 for empty rows."""
    above = (weight * table) @ other.conj()
    below = weight @ np.abs(other) ** 2
    return np.asarray(above / np.where(below > 0, below, 1.0))
