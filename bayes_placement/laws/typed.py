"""A law from its text as it is typed; nothing in the text is run."""

import ast
from collections.abc import Mapping
from typing import Any

from numpyro import distributions

from .._shared.errors import InputError
from .elements import Dashpot, LossySpring, Mass, Spring, Springpot
from .law import Law

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
    >>> from bayes_placement.laws.typed import typed
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
