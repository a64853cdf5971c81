"""The dynamic stiffness of a network as a formula."""

from collections.abc import Iterator

from .law import Law, Parallel, Scaled, Series
from .symbols import Owned, numbers


def formula(law: Law) -> str:
    r"""LaTeX of the dynamic stiffness, with the symbols of `symbols.numbers`.

    Examples
    --------
    >>> from bayes_placement.laws.formula import formula
    >>> print(formula(bp.effects.Spring(1e4) - bp.effects.Mass(0.1)))
    \left(\frac{1}{k} + \frac{1}{-\omega^2 m}\right)^{-1}
    """
    return _formula(law, iter(numbers(law)))


def _formula(law: Law, owned: Iterator[Owned]) -> str:
    if isinstance(law, Series):
        inverses = " + ".join(_inverse(_formula(part, owned)) for part in law.parts)
        return rf"\left({inverses}\right)^{{-1}}"
    if isinstance(law, Parallel):
        return " + ".join(_formula(part, owned) for part in law.parts).replace("+ -", "- ")
    symbols = [number.latex for number in next(owned)[1]]
    if isinstance(law, Scaled):
        return f"{symbols[0]} {_factor(law.law, _formula(law.law, owned))}"
    return law.formula.format(*symbols)  # type: ignore[attr-defined]


def _inverse(term: str) -> str:
    return rf"\frac{{1}}{{{term}}}"


def _factor(law: Law, term: str) -> str:
    """Formula of a law as a factor: a sum, or what begins with a minus, stands in brackets."""
    bare = not isinstance(law, Parallel) and not term.startswith("-")
    return term if bare else rf"\left({term}\right)"
