"""Modes of an undamped structure: what every other room reads of it."""

import abc
from typing import TypeAlias

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import Distribution, Uniform

from .._shared.compiled import compiled
from .._shared.reprs import with_short_repr
from .._shared.sites import check_numbers
from ..positions.bounds import Bounds
from ..positions.places import Straight

Coordinates: TypeAlias = Float[Array, "*coordinate"]
"""A position [m]: on a line, or in space."""

AxisShapes: TypeAlias = Float[Array, "axis mode"]
"""Mode shapes along the axes in which a structure moves [kg^-1/2]."""

Flexibility: TypeAlias = Float[Array, "axis axis"] | None
"""Flexibility between two positions [m/N]; None if not known."""

Orders: TypeAlias = tuple[int, int]
"""Orders of the derivatives in two positions."""


@with_short_repr
class Modes(eqx.Module):
    """Natural frequencies and mass-normalised mode shapes, known at any point.

    Examples
    --------
    >>> isinstance(bar, bp.modes.Modes), bar.bounds()
    (True, (0.0, 1.0))
    """

    axes: eqx.AbstractVar[tuple[int, ...]]
    rigid_body_modes: eqx.AbstractVar[int]

    @abc.abstractmethod
    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies [rad/s], rigid-body modes first with 0."""

    @abc.abstractmethod
    def shapes(self, position: Coordinates, derivative: int = 0) -> AxisShapes:
        """Mass-normalised mode shapes [kg^-1/2] along `axes` at a position [m].

        Parameters
        ----------
        position
            Where they are read [m].
        derivative
            Order of the derivative in position [kg^-1/2 m^-order].
        """

    @abc.abstractmethod
    def static_flexibility(
        self, position: Coordinates, other: Coordinates, orders: Orders = (0, 0)
    ) -> Flexibility:
        """Static flexibility [m/N] of all elastic modes, kept or not; None if not known.

        The sum over all of them of phi phi / omega_n^2. With it a modal sum is exact at low
        frequency, however few modes are kept (MacNeal 1971, DOI 10.1016/0045-7949(71)90031-9).

        Parameters
        ----------
        position, other
            Positions of response and force [m].
        orders
            Orders of the derivatives in the two positions; asked for above 0 of modes only whose
            shapes have derivatives.
        """

    def second_flexibility_left_out(
        self, position: Coordinates, other: Coordinates, orders: Orders
    ) -> Flexibility:
        """Sum over the modes left out of phi phi / omega_n^4 [m s2/N]; None if not known.

        It is the next term of the receptance in omega^2: the mass of the modes left out, which the
        internal force of a cut under the opening of another needs. It is zero of all else.
        """
        return None

    @abc.abstractmethod
    def bounds(self) -> Bounds:
        """Return the least and the greatest position on the structure [m]."""

    def anywhere(self) -> list[Distribution | Straight]:
        """Return the uniform distribution of a position on each piece of the structure [m]."""
        return [Uniform(*self.bounds())]

    def solved(self) -> "Modes":
        """Return the modes once all parameters are numbers; most modes need no solution."""
        return self

    def coupling(self) -> Float[Array, "mode mode"] | None:
        """Stiffness [(rad/s)^2] between modes of one frequency.

        It is zero, and None where its derivative is zero too. Eigenvectors of a repeated frequency
        have no derivative in the parameters; the derivative of the response needs this one.
        """
        return None

    @property
    def natural_frequency(self) -> Float[Array, "mode"]:
        """Natural frequencies [Hz]."""
        check_numbers(self, "natural_frequency")
        return self.angular_frequency() / (2 * jnp.pi)


Squares: TypeAlias = Float[np.ndarray, "place mode"] | Float[Array, "place mode"]


def moved_mass(squares: Squares) -> float:
    """Estimate the mass of a structure [kg] from shapes at places spread evenly over it.

    They are squares of mass-normalised shapes [1/kg], summed over directions. The mean square over
    a uniform structure is one over its mass. The median over the modes passes over the few that
    move one part only.
    """
    return float(1 / np.median(np.mean(np.asarray(squares, float), axis=0)))


def frequencies_of(modes: Modes) -> Float[np.ndarray, "mode"]:
    """Natural frequencies [Hz]: one compiled function serves all modes of one form."""
    return np.asarray(compiled(_natural_frequency)(modes))


def _natural_frequency(modes: Modes) -> Float[Array, "mode"]:
    return modes.natural_frequency
