"""Matrices of parts of a structure, over its modes.

Matrices by name come in, one array with the names goes out. What they are of is not known here.
"""

from collections.abc import Mapping

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ..._shared.compiled import of_jax
from ..._shared.errors import InputError
from ...positions.names import printable_name


class NamedMatrices(eqx.Module):
    """Matrices over the modes, each named after a part of the structure."""

    matrices: Float[Array, "part mode mode"]
    names: tuple[str, ...] = eqx.field(static=True)

    def __repr__(self) -> str:
        return ", ".join(self.names) or "none"

    @classmethod
    def of(cls, parts: Mapping[str, np.ndarray], count: int) -> "NamedMatrices":
        """Stack matrices over `count` modes by name; there may be none."""
        for name, part in parts.items():
            printable_name("A part of the name", name)
            if np.shape(part) != (count, count):
                raise InputError(
                    f'The part "{name}" has the shape {np.shape(part)}; a matrix of {count} rows '
                    "and columns is needed, one for each mode, since it is over the modes: "
                    "shape.T @ part @ shape."
                )
        stacked = np.stack(list(parts.values())) if parts else np.zeros((0, count, count))
        return cls(of_jax(stacked), tuple(parts))
