"""Laws of what hangs on a port, and how they combine: in parallel `|`, in series `-`."""

import abc
import dataclasses
from functools import reduce
from typing import Any, ClassVar, TypeAlias

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Inexact

from .._shared.arguments import check_annotated, shown
from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.ranges import described
from .._shared.reprs import notebook_html
from .._shared.sites import check_scalar, is_unknown, unit

Omega: TypeAlias = Inexact[Array, "frequency"]
"""Angular frequencies [rad/s], complex off the axis: s = i omega."""

Stiffness: TypeAlias = Inexact[Array, "frequency"]
"""Dynamic stiffness at each angular frequency: force over displacement, moment over rotation."""

Fraction: TypeAlias = tuple[Stiffness, Stiffness | float]
"""Numerator N and denominator D of a dynamic stiffness N / D."""

Tree: TypeAlias = str | list[Any]
"""Letter of an element, or a group: `["|", "k", "c"]` in parallel, `["-", "k", "m"]` in series."""

ONE = 1.0
"""Denominator of an element."""

FLOATING = (
    "Two parts of a chain have masses, of which one alone can move against the ground: a line "
    "leaves the mass of the other; what moves against another part is an inerter."
)


class Law(eqx.Module):
    """A network of elements: what hangs on a port, by its dynamic stiffness N / D.

    In parallel dynamic stiffnesses add, in series their inverses. A mass moves against the ground.

    Examples
    --------
    >>> mount = bp.effects.Spring(2e4) - bp.effects.Dashpot(40.0)
    >>> mount
    Spring(20000.0) - Dashpot(40.0)
    >>> complex(mount.dynamic_stiffness(jnp.array([500.0]))[0])
    (10000+10000j)
    """

    def __check_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if value is None:
                check_annotated(field.name, value, Parameter)
            if "unit" in field.metadata:
                check_scalar(field.name, value)

    @abc.abstractmethod
    def fraction(self, omega: Omega) -> Fraction:
        """Numerator and denominator of the dynamic stiffness at angular frequencies [rad/s].

        As a pair a law of no strength, N = 0, changes nothing, and a pole, D = 0, holds the port.
        """

    @abc.abstractmethod
    def tree(self) -> Tree:
        """Letters of the elements, in groups."""

    def dynamic_stiffness(self, omega: Omega) -> Stiffness:
        """Force per displacement of the port [N/m], or moment per rotation [N m/rad].

        Parameters
        ----------
        omega
            Angular frequencies [rad/s]; time convention exp(+i omega t).
        """
        numerator, denominator = self.fraction(omega)
        return jnp.broadcast_to(jnp.asarray(numerator / denominator), omega.shape)

    def in_words(self) -> str:
        """The network in words, without its numbers.

        Examples
        --------
        >>> (bp.effects.Spring(2e4) - bp.effects.Mass(0.3)).in_words()
        'mass - spring'
        """
        from .catalogue import canonical, in_words

        return in_words(canonical(self.tree()))

    def drawing(self) -> str:
        """SVG of the network from the port, a small circle, to the ground and to its masses.

        Each element has its values below it. The ground stands for the other end where the law is
        that of a strut or of a cut. The order of a chain is of no consequence, so that masses are
        drawn at its end.

        Examples
        --------
        >>> law = bp.effects.Spring(2e4) - bp.effects.Mass(0.3)
        >>> "m = 0.3 kg" in law.drawing()
        True
        """
        from .symbols import drawing

        return drawing(self)

    def _repr_latex_(self) -> str:
        from .symbols import formula

        return rf"$\displaystyle Z = {formula(self)}$"

    def _repr_html_(self) -> str:
        from .catalogue import is_grounded
        from .symbols import table

        sentences = [] if is_grounded(self.tree()) else [FLOATING]
        return notebook_html(repr(self), table(self), sentences, self.drawing())

    def __or__(self, other: object) -> "Parallel":
        return Parallel((*_parts(self, Parallel), *_parts(other, Parallel)))

    def __sub__(self, other: object) -> "Series":
        return Series((*_parts(self, Series), *_parts(other, Series)))

    def __rmul__(self, strength: Parameter) -> "Scaled":
        return Scaled(self, strength)


class Element(Law):
    """One spring, dashpot or mass: its dynamic stiffness is a number times a power of s."""

    letter: eqx.AbstractClassVar[str]
    symbols: eqx.AbstractClassVar[tuple[str, ...]]
    formula: eqx.AbstractClassVar[str]

    def fraction(self, omega: Omega) -> Fraction:
        """Return its dynamic stiffness over one."""
        return self.stiffness_at(omega), ONE

    @abc.abstractmethod
    def stiffness_at(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness [N/m]."""

    def tree(self) -> Tree:
        """Letter of the element."""
        return self.letter

    def __repr__(self) -> str:
        values = (getattr(self, field.name) for field in dataclasses.fields(self))
        return f"{type(self).__name__}({', '.join(_value(value) for value in values)})"


class Group(Law):
    """Several laws together."""

    parts: eqx.AbstractVar[tuple[Law, ...]]
    sign: eqx.AbstractClassVar[str]

    def __check_init__(self) -> None:
        for part in self.parts:
            _parts(part, Series)
        if len(self.parts) < 2:
            raise _no_network(f"{len(self.parts)} of them")

    def fraction(self, omega: Omega) -> Fraction:
        """Fractions of all parts, two at a time."""
        return reduce(self.of_two, [part.fraction(omega) for part in self.parts])

    @abc.abstractmethod
    def of_two(self, one: Fraction, other: Fraction) -> Fraction:
        """Fraction of two parts."""

    def tree(self) -> Tree:
        """Group of the trees of its parts."""
        return [self.sign, *(part.tree() for part in self.parts)]


class Parallel(Group):
    """Laws that share the displacement of the port, `a | b`: their dynamic stiffnesses add.

    Parameters
    ----------
    parts
        The laws.

    Examples
    --------
    >>> (bp.effects.Spring(1e4) | bp.effects.Dashpot(20.0)).tree()
    ['|', 'k', 'c']
    """

    sign: ClassVar[str] = "|"
    parts: tuple[Law, ...]

    def of_two(self, one: Fraction, other: Fraction) -> Fraction:
        """N1 D2 + N2 D1 over D1 D2."""
        return _times(one[0], other[1]) + _times(other[0], one[1]), _times(one[1], other[1])

    def __repr__(self) -> str:
        return " | ".join(map(repr, self.parts))


class Series(Group):
    """Laws that share the force of the port, `a - b`: their compliances add.

    Parameters
    ----------
    parts
        The laws, from the port to the ground or the last mass.

    Examples
    --------
    >>> (bp.effects.Spring(1e4) - bp.effects.Mass(0.1)).tree()
    ['-', 'k', 'm']
    """

    sign: ClassVar[str] = "-"
    parts: tuple[Law, ...]

    def of_two(self, one: Fraction, other: Fraction) -> Fraction:
        """N1 N2 over N1 D2 + N2 D1."""
        return one[0] * other[0], _times(one[0], other[1]) + _times(other[0], one[1])

    def __repr__(self) -> str:
        return " - ".join(map(_factor, self.parts))


class Scaled(Law):
    """A law of which every stiffness, viscosity and mass is multiplied, `strength * law`.

    Parameters
    ----------
    law
        The law.
    strength
        The factor [1]; with zero nothing hangs on the port.

    Examples
    --------
    >>> 0.5 * (bp.effects.Spring(1e4) - bp.effects.Mass(0.1))
    0.5 * (Spring(10000.0) - Mass(0.1))
    """

    symbols: ClassVar[tuple[str, ...]] = ("lambda",)
    law: Law
    strength: Parameter = eqx.field(metadata=unit("1"))

    def fraction(self, omega: Omega) -> Fraction:
        """Numerator times the strength, over the denominator."""
        numerator, denominator = self.law.fraction(omega)
        return self.strength * numerator, denominator

    def tree(self) -> Tree:
        """Tree of the law."""
        return self.law.tree()

    def __repr__(self) -> str:
        return f"{_value(self.strength)} * {_factor(self.law)}"


def _factor(law: Law) -> str:
    """Law as it is typed next to a hyphen or an asterisk: a bar binds less."""
    return f"({law!r})" if isinstance(law, Group) else repr(law)


def _parts(law: object, kind: type[Group]) -> tuple[Law, ...]:
    """Parts of a group of a kind, which joins a greater one of it; else the law itself."""
    if not isinstance(law, Law):
        raise _no_network(shown(law))
    return law.parts if isinstance(law, kind) else (law,)


def _no_network(given: str) -> InputError:
    return InputError(
        f"{given} was given as a part of a network; two laws or more are needed, since a network "
        "is made of elements: effects.Spring(1e4) | effects.Dashpot(10.0)."
    )


def _times(numerator: Stiffness | float, denominator: Stiffness | float) -> Any:
    """Product with a denominator, which is one of elements: nothing is multiplied then."""
    return numerator if denominator is ONE else numerator * denominator


def _value(value: object) -> str:
    return described(value) if is_unknown(value) else repr(value)
