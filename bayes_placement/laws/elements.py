"""Elements of networks, and laws of them as they are typed; nothing in a text is run."""

import ast
from collections.abc import Mapping
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from numpyro import distributions

from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.ranges import ORDER, POSITIVE
from .._shared.sites import unit
from .law import Element, Law, Omega, Stiffness


class Spring(Element):
    """A spring, the dynamic stiffness k at every frequency.

    Parameters
    ----------
    stiffness
        Stiffness k [N/m]; of a rotation [N m/rad].

    Examples
    --------
    >>> bp.effects.Spring(dist.LogUniform(1e3, 1e6))
    Spring(LogUniform(1000, 1e+06))
    """

    letter: ClassVar[str] = "k"
    symbols: ClassVar[tuple[str, ...]] = ("k",)
    formula: ClassVar[str] = r"{0}"
    stiffness: Parameter = eqx.field(metadata=unit("N/m"))

    def stiffness_at(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness k [N/m]."""
        return jnp.broadcast_to(jnp.asarray(self.stiffness, float), omega.shape)


class LossySpring(Element):
    """A spring with a loss factor, the dynamic stiffness k (1 + i eta sign omega).

    Parameters
    ----------
    stiffness
        Stiffness k [N/m]; of a rotation [N m/rad].
    loss_factor
        Loss factor eta [1].

    Examples
    --------
    >>> complex(bp.effects.LossySpring(1e4, 0.25).dynamic_stiffness(jnp.array([-3.0]))[0])
    (10000-2500j)
    """

    letter: ClassVar[str] = "h"
    symbols: ClassVar[tuple[str, ...]] = ("k", "eta")
    formula: ClassVar[str] = r"{0} (1 + i {1})"
    stiffness: Parameter = eqx.field(metadata=unit("N/m"))
    loss_factor: Parameter = eqx.field(metadata=unit("1"))

    def stiffness_at(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness k (1 + i eta sign omega) [N/m]."""
        return self.stiffness * (1 + 1j * self.loss_factor * jnp.sign(jnp.real(omega)))


class Springpot(Element):
    """A springpot, the dynamic stiffness k (i omega / omega_0)^order: rubber, soil, glue.

    Bagley and Torvik, AIAA Journal 21 (1983) 741, DOI 10.2514/3.8142.

    Parameters
    ----------
    stiffness
        Magnitude k of the dynamic stiffness at the reference frequency [N/m].
    order
        Order from 0, a spring, to 1, a dashpot [1].
    frequency
        Reference frequency omega_0 / (2 pi) [Hz].

    Examples
    --------
    >>> rubber = bp.effects.Springpot(1e4, order=0.5, frequency=50.0)
    >>> complex(rubber.dynamic_stiffness(jnp.array([2 * np.pi * 50.0]))[0] / 1e4)
    (0.7071067811865476+0.7071067811865475j)
    """

    letter: ClassVar[str] = "p"
    symbols: ClassVar[tuple[str, ...]] = ("k", "alpha", "f")
    formula: ClassVar[str] = r"{0} \left(\frac{{i\omega}}{{2\pi {2}}}\right)^{{{1}}}"
    stiffness: Parameter = eqx.field(metadata=unit("N/m"))
    order: Parameter = eqx.field(metadata=unit("1", within=ORDER))
    frequency: Parameter = eqx.field(metadata=unit("Hz", within=POSITIVE), default=1.0)

    def stiffness_at(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness k (i omega / omega_0)^order [N/m]."""
        ratio = 1j * omega / (2 * jnp.pi * jnp.asarray(self.frequency))
        # The principal branch is conjugate at -omega; at rest the derivative in order is finite.
        logarithm = jnp.log(jnp.where(ratio == 0, 1e-300, ratio))
        return self.stiffness * jnp.exp(self.order * logarithm)


class Dashpot(Element):
    """A viscous dashpot, the dynamic stiffness i omega c.

    Parameters
    ----------
    viscosity
        Force per velocity c [N s/m]; of a rotation [N m s/rad].

    Examples
    --------
    >>> complex(bp.effects.Dashpot(40.0).dynamic_stiffness(jnp.array([500.0]))[0])
    20000j
    """

    letter: ClassVar[str] = "c"
    symbols: ClassVar[tuple[str, ...]] = ("c",)
    formula: ClassVar[str] = r"i\omega {0}"
    viscosity: Parameter = eqx.field(metadata=unit("N s/m"))

    def stiffness_at(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness i omega c [N/m]."""
        return 1j * omega * self.viscosity


class Mass(Element):
    """A mass, the dynamic stiffness -omega^2 m; in series it is the end of the chain.

    Parameters
    ----------
    mass
        Mass m [kg]; of a rotation its moment of inertia [kg m2]. Negative if removed.

    Examples
    --------
    >>> float(bp.effects.Mass(0.1).dynamic_stiffness(jnp.array([100.0]))[0])
    -1000.0
    """

    letter: ClassVar[str] = "m"
    symbols: ClassVar[tuple[str, ...]] = ("m",)
    formula: ClassVar[str] = r"-\omega^2 {0}"
    mass: Parameter = eqx.field(metadata=unit("kg"))

    def stiffness_at(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness -omega^2 m [N/m]."""
        return -(omega**2) * self.mass


ELEMENTS: Mapping[str, type[Law]] = {
    kind.__name__: kind for kind in (Spring, Dashpot, Mass, Springpot, LossySpring)
}

PRIORS: Mapping[str, type[distributions.Distribution]] = {
    name: getattr(distributions, name) for name in ("Uniform", "LogUniform", "LogNormal", "Normal")
}
"""Distributions that the numbers of a law may have in a text."""


def typed(text: str) -> Law:
    """Return the law of a text, such as the `law` of an entry in `ledger.json`.

    It has elements with numbers or priors, `|` in parallel, `-` in series, a factor before `*`.

    Examples
    --------
    >>> from bayes_placement.laws.elements import typed
    >>> typed("Spring(2e4) - Dashpot(Uniform(10, 50))")
    Spring(20000.0) - Dashpot(Uniform(10, 50))
    """
    try:
        law = _read(ast.parse(text, mode="eval").body)
    except (SyntaxError, ValueError, TypeError, KeyError, RecursionError, MemoryError) as error:
        raise _no_law(text) from error
    if not isinstance(law, Law):
        raise _no_law(text)
    return law


def _no_law(text: str) -> InputError:
    return InputError(
        f"{text[:80]!r} was given as a law; elements ({', '.join(ELEMENTS)}) of numbers or priors "
        f"({', '.join(PRIORS)}) are needed, with | in parallel and - in series: "
        '"Spring(2e4) - Dashpot(40.0)".'
    )


def _read(node: ast.expr) -> Any:
    """Law, prior or number of a part of the text."""
    match node:
        case ast.BinOp(left=left, op=ast.BitOr(), right=right):
            return _read(left) | _read(right)
        case ast.BinOp(left=left, op=ast.Sub(), right=right):
            return _read(left) - _read(right)
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            return _read(left) * _read(right)
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
            return {**ELEMENTS, **PRIORS}[name](*map(_read, arguments))
        case _:
            return float(ast.literal_eval(node))
