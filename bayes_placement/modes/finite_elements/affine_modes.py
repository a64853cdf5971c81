"""Modes of matrices whose parts are scaled by parameters, in a fixed basis."""

import functools
import operator
from collections import OrderedDict

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._shared.dimensions import Parameter
from ..._shared.sites import unit
from ..changed import ChangedModes, changed
from ..modes import Modes
from ._part_factors import NamedMatrices
from .nodal_modes import DerivedNodalModes, NodalModes

Point = Float[Array, "3"]
Powers = tuple[tuple[str, float | int], ...]


class ScaledResidual(DerivedNodalModes):
    """Nodal modes whose static flexibility is that of scaled parts.

    Under constant forces the strain energy of a part grows with its flexibility, so that the static
    flexibility becomes F + sum_i (1 / f_i - 1) F K_i F: exact where one factor scales the entire
    structure and where it is statically determinate, of first order elsewhere.
    """

    nodal: NodalModes
    residual: Float[np.ndarray | Array, "part row row"]
    added_flexibility: Float[Array, "part"]
    axes: tuple[int, ...] = eqx.field(static=True)
    rigid_body_modes: int = eqx.field(static=True)

    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies [rad/s]."""
        return self.nodal.angular_frequency()

    def shapes(self, position: Point, derivative: int = 0) -> Float[Array, "axis mode"]:
        """Mass-normalised mode shapes [kg^-1/2]."""
        return self.nodal.shapes(position, derivative)

    def static_flexibility(
        self, position: Point, other: Point, orders: tuple[int, int] = (0, 0)
    ) -> Float[Array, "axis axis"] | None:
        """Static flexibility [m/N], without the change of what the basis spans."""
        nodal = self.nodal
        if nodal.flexibility is None:
            return None
        response = nodal.interpolation.at(position)
        reference = nodal.interpolation.at(other)
        rows = (response.rows[:, None], reference.rows)
        added = jnp.tensordot(self.added_flexibility, self.residual[:, *rows], 1)
        between = nodal.flexibility[rows] + added
        return response.weight @ between @ reference.weight.T / nodal.stiffness_scale()


class AffineModes(DerivedNodalModes):
    """Modes of K + sum_i (f_i - 1) K_i and M likewise, in a fixed basis.

    Each factor f_i is a product of powers of the parameters: a modulus scales the stiffness of its
    region, a thickness the bending stiffness by its cube and the mass by itself. The sparse
    eigenproblem is solved once before; the one solved here is dense, in the basis, and its first
    derivatives are exact. Made by `finite_elements.affine`.

    Parameters
    ----------
    nodal
        The basis as nominal modes: mass-orthonormal, of diagonal stiffness.
    parameter
        Parameters over their nominal values [1], numbers or distributions.
    stiffness, mass
        Matrices of the parts in the basis.
    powers
        For each part the power of each parameter.
    residual
        For each part of the stiffness F K_i F [m/N], F the static flexibility of what the basis
        leaves out, between the rows that are read.
    report
        One sentence on the accuracy of the natural frequencies.
    frequency_error
        Largest measured relative error of a natural frequency [1].

    Examples
    --------
    >>> root = {"root": dist.Uniform(0.5, 1.5)}
    >>> modes = bp.finite_elements.affine(matrices, reading, parameters=root, up_to=60.0)
    >>> modes.frequency_error < 1e-3
    True
    """

    nodal: NodalModes
    parameter: OrderedDict[str, Parameter] = eqx.field(metadata=unit("1"))
    stiffness: NamedMatrices = eqx.field(repr=False)
    mass: NamedMatrices = eqx.field(repr=False)
    residual: Float[Array, "part row row"] | None = eqx.field(repr=False)
    powers: tuple[tuple[str, Powers], ...] = eqx.field(static=True, repr=False)
    report: str = eqx.field(static=True, repr=False)
    frequency_error: float = eqx.field(static=True)
    axes: tuple[int, ...] = eqx.field(static=True, repr=False)
    rigid_body_modes: int = eqx.field(static=True, repr=False)

    def factor(self, part: str) -> Float[Array, ""]:
        """Factor of a part [1]."""
        powers = dict(self.powers)[part]
        terms = [jnp.asarray(self.parameter[name], float) ** float(power) for name, power in powers]
        return functools.reduce(operator.mul, terms)

    def solved(self) -> ChangedModes:
        """Return the modes once the parameters are numbers."""
        nodal = self.nodal
        scale = nodal.stiffness_scale() / nodal.mass_scale()
        mass = self._sum(self.mass) if self.mass.names else None
        return changed(self._with_residual(), self._sum(self.stiffness) * scale, mass)

    def _with_residual(self) -> Modes:
        if self.residual is None or not self.stiffness.names:
            return self.nodal
        flexibility = jnp.stack([1 / self.factor(name) - 1 for name in self.stiffness.names])
        return ScaledResidual(
            nodal=self.nodal,
            residual=self.residual,
            added_flexibility=flexibility,
            axes=self.axes,
            rigid_body_modes=self.rigid_body_modes,
        )

    def _sum(self, parts: NamedMatrices) -> Float[Array, "mode mode"]:
        if not parts.names:
            return jnp.zeros(parts.matrices.shape[1:])
        excess = jnp.stack([self.factor(name) - 1 for name in parts.names])
        return jnp.tensordot(excess, parts.matrices, 1)

    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies [rad/s]."""
        return self.solved().angular_frequency()

    def shapes(self, position: Point, derivative: int = 0) -> Float[Array, "axis mode"]:
        """Mass-normalised mode shapes [kg^-1/2]."""
        return self.solved().shapes(position, derivative)

    def static_flexibility(
        self, position: Point, other: Point, orders: tuple[int, int] = (0, 0)
    ) -> Float[Array, "axis axis"] | None:
        """Static flexibility [m/N]: exact for nominal parameters, else changed in the basis."""
        return self.solved().static_flexibility(position, other)
