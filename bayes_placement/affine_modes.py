"""affine_modes: in, a fixed basis and matrices that parameters scale; out, modes for any of them.

Not known here: how the basis was found, files, damping, probability.
"""

from collections import OrderedDict
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._changed_modes import ChangedModes, changed
from ._sites import unit
from ._types import Parameter
from ._vectors import Coordinates
from .modes import Modes
from .nodal_modes import Named, NodalModes

Point = Float[Array, "3"]


class AffineModes(Modes):
    """Modes of K + sum_i (f_i - 1) K_i and M likewise, in a fixed basis.

    Each factor f_i is a product of powers of the parameters: a modulus scales the stiffness of its
    region, a thickness the bending stiffness by its cube and the mass by itself. The eigenproblem
    of the model is solved before; here it is one in the basis, whose derivatives are exact.

    Parameters
    ----------
    nodal
        The basis as nominal modes: mass-orthonormal, of diagonal stiffness.
    parameter
        Parameters over their nominal values [1], numbers or laws.
    stiffness, mass
        Matrices of the parts in the basis.
    powers
        For each part the power of each parameter.
    """

    nodal: NodalModes
    parameter: OrderedDict[str, Parameter] = eqx.field(metadata=unit("1"))
    stiffness: Named
    mass: Named
    powers: tuple[tuple[str, tuple[tuple[str, float], ...]], ...] = eqx.field(static=True)
    axes: tuple[int, ...] = eqx.field(static=True)
    rigid_body_modes: int = eqx.field(static=True)

    def __init__(
        self,
        nodal: NodalModes,
        *,
        parameter: Mapping[str, Parameter],
        stiffness: Mapping[str, np.ndarray],
        mass: Mapping[str, np.ndarray],
        powers: Mapping[str, Mapping[str, float]],
    ):
        self.nodal = nodal
        self.parameter = OrderedDict(parameter)
        count = nodal.shape.shape[1]
        self.stiffness, self.mass = Named.of(stiffness, count), Named.of(mass, count)
        self.powers = tuple((part, tuple(each.items())) for part, each in powers.items())
        self.axes, self.rigid_body_modes = nodal.axes, nodal.rigid_body_modes

    def factor(self, part: str) -> Float[Array, ""]:
        """Factor of a part [1]."""
        each = dict(self.powers)[part]
        scaled = [jnp.asarray(self.parameter[name], float) ** power for name, power in each]
        return jnp.prod(jnp.stack(scaled))

    def solved(self) -> ChangedModes:
        """Return the modes once the parameters are numbers."""
        nodal = self.nodal
        scale = nodal.stiffening() / nodal.heaviness()
        mass = self._sum(self.mass) if self.mass.names else None
        return changed(nodal, self._sum(self.stiffness) * scale, mass)

    def _sum(self, parts: Named) -> Float[Array, "mode mode"]:
        if not parts.names:
            return jnp.zeros(parts.matrices.shape[1:])
        excess = jnp.stack([self.factor(name) - 1 for name in parts.names])
        return jnp.tensordot(excess, jnp.asarray(parts.matrices), 1)

    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies [rad/s]."""
        return self.solved().angular_frequency()

    def shapes(self, position: Point, derivative: int = 0) -> Float[Array, "axis mode"]:
        """Mass-normalised mode shapes [kg^-1/2]."""
        return self.solved().shapes(position, derivative)

    def static_flexibility(self, position: Point, other: Point) -> Float[Array, "axis axis"] | None:
        """Static flexibility [m/N]: exact for nominal parameters, changed in the basis."""
        return self.solved().static_flexibility(position, other)

    def bounds(self) -> tuple[Coordinates, Coordinates]:
        """Return the least and the greatest coordinates [m]."""
        return self.nodal.bounds()

    def anywhere(self) -> list[Any]:
        """Return the members or surfaces on which something may sit."""
        return self.nodal.anywhere()
