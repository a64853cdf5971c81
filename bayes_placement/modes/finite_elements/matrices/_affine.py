"""Matrices as affine functions of factors of their parts."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.sparse import csc_array

from ...._shared.reprs import with_short_repr

CORNERS = 6  # factors, up to which every corner of the box is a sample

Factors = Mapping[str, float]
Weights = Float[np.ndarray, "_"]
"""Of the nominal matrix, which is 1, and of each part."""


@with_short_repr
class Affine(NamedTuple):
    """Parts of the stiffness and mass that factors scale: K + sum_i (factor_i - 1) K_i, M likewise.

    A name that stands in both scales both. Powers, such as that of a thickness in bending, are
    separate factors.

    Examples
    --------
    >>> bp.finite_elements.Affine({"root": matrices.regions["root"]}, {}, {"root": (0.5, 1.5)}).box
    {'root': (0.5, 1.5)}
    """

    stiffness: Mapping[str, csc_array]
    mass: Mapping[str, csc_array]
    box: Mapping[str, tuple[float, float]]
    """Least and greatest value of each factor [1]; 1 is nominal."""

    def among(self, rows: np.ndarray) -> "Affine":
        """Return the same on some rows, in their order."""
        stiffness, mass = (
            {name: csc_array(csc_array(part)[rows][:, rows]) for name, part in parts.items()}
            for parts in (self.stiffness, self.mass)
        )
        return Affine(stiffness, mass, self.box)

    def weights(self, factors: Factors) -> tuple[Weights, Weights]:
        """Weights of the nominal matrix and of each part, for stiffness and for mass."""
        return (
            np.array([1.0, *(factors[name] - 1 for name in self.stiffness)]),
            np.array([1.0, *(factors[name] - 1 for name in self.mass)]),
        )

    def samples(self, count: int) -> list[dict[str, float]]:
        """Corners of the box (up to six factors) and points of a Sobol sequence."""
        from scipy.stats import qmc  # it takes long to import

        size = len(self.box)
        corners = np.array(np.meshgrid(*[[0.0, 1.0]] * size)).reshape(size, -1).T
        inside = qmc.Sobol(size, scramble=False).random_base2(int(np.log2(count)))[1:]
        return self._factors(inside if size > CORNERS else np.vstack([corners, inside]))

    def random(self, count: int, seed: int) -> list[dict[str, float]]:
        """Points drawn uniformly in the box."""
        return self._factors(np.random.default_rng(seed).uniform(size=(count, len(self.box))))

    def _factors(self, shares: np.ndarray) -> list[dict[str, float]]:
        low, high = np.array(list(self.box.values())).T
        values = (low + shares * (high - low)).tolist()
        return [dict(zip(self.box, point, strict=True)) for point in values]


def scaled(nominal: csc_array, parts: Mapping[str, csc_array], weights: Weights) -> csc_array:
    """Matrix for some weights."""
    total = nominal
    for part, weight in zip(parts.values(), weights[1:], strict=True):
        total = total + weight * part
    return csc_array(total)
