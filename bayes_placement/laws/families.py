"""Families of dynamic stiffness: all that a network may show with positive values."""

import json
from collections.abc import Iterator
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from .law import Tree

POWERS = {"k": 0.0, "c": 1.0, "m": 2.0}
"""Power of s in the dynamic stiffness of an element; that of a springpot is unknown."""

NUMBERS = {"k": 1, "c": 1, "m": 1, "p": 2}

# Away from the axes there are no poles, and no sum of elements leaves a sector of 120 degrees.
S = np.geomspace(1e-3, 1e3, 48) * np.exp(1j * np.pi / 3)

EQUAL = 1e-8
"""Greatest relative difference of two dynamic stiffnesses that are one."""

TARGETS, STARTS = 3, 12

Response: TypeAlias = tuple[Any, Any]
"""Logarithm of the dynamic stiffness at S, and its slopes along the numbers."""


def invariant(tree: Tree) -> tuple[Any, ...]:
    """What networks of one family have in common: powers of s at both ends, and free numbers.

    A springpot is counted as a spring and as a dashpot, the ends of its order.
    """
    ends = [_power(tree, order, end) for order in (0.0, 1.0) for end in (-1, 1)]
    return *ends, _free_numbers(json.dumps(tree))


def same_family(one: Tree, other: Tree) -> bool:
    """Whether each of two networks can have every dynamic stiffness that the other has.

    Decided from the dynamic stiffness: each is fitted to the other at random positive values.
    """
    ends = [json.dumps(one), json.dumps(other)]
    return one == other or (_reaches(*ends) and _reaches(*reversed(ends)))


def response(tree: Tree, numbers: Any) -> Response:
    """Logarithm of the dynamic stiffness at S, and its slopes.

    Numbers are logarithms of the values in the order of the leaves; of an order n log(n / (1 - n)).
    """
    return _response(tree, iter(enumerate(numbers)), len(numbers))


@cache
def _reaches(text: str, goal: str) -> bool:
    """Whether a network can have the dynamic stiffness of another at random values."""
    tree, other = json.loads(text), json.loads(goal)
    random = np.random.default_rng(0)
    targets = [response(other, _random(other, random))[0] for _ in range(TARGETS)]
    return all(_fits(tree, target, random) for target in targets)


def _fits(tree: Tree, target: Any, random: np.random.Generator) -> bool:
    """Whether a network has a dynamic stiffness at some values, from one of several starts."""
    return any(_distance(tree, target, _random(tree, random)) < EQUAL for _ in range(STARTS))


def _distance(tree: Tree, target: Any, start: Any) -> float:
    """Greatest relative difference from a target after least squares."""

    def misfit(numbers: Any) -> Any:
        return _real(response(tree, numbers)[0] - target)

    def slopes(numbers: Any) -> Any:
        return _real(response(tree, numbers)[1].T)

    from scipy.optimize import least_squares  # it takes long to import

    tight = 1e-15
    fit = least_squares(
        misfit, start, slopes, bounds=(-25, 25), xtol=tight, ftol=tight, gtol=tight, max_nfev=200
    )
    return float(np.abs(fit.fun).max())


@cache
def _free_numbers(text: str) -> int:
    """Number of directions in which the dynamic stiffness changes."""
    tree = json.loads(text)
    slopes = response(tree, _random(tree, np.random.default_rng(1)))[1]
    return int(np.linalg.matrix_rank(_real(slopes.T), tol=1e-9))


def _random(tree: Tree, random: np.random.Generator) -> Any:
    """Logarithms of values of a network, of about one."""
    return random.normal(size=_numbers(tree))


def _numbers(tree: Tree) -> int:
    return NUMBERS[tree] if isinstance(tree, str) else sum(_numbers(part) for part in tree[1:])


def _response(tree: Tree, numbers: Iterator[tuple[int, float]], size: int) -> Response:
    if isinstance(tree, str):
        return _of_element(tree, numbers, size)
    sign = 1 if tree[0] == "|" else -1
    logs, slopes = zip(*(_response(part, numbers, size) for part in tree[1:]), strict=True)
    terms = np.exp(sign * np.stack(logs))
    total = terms.sum(axis=0)
    return sign * np.log(total), ((terms / total)[:, None] * np.stack(slopes)).sum(axis=0)


def _of_element(letter: str, numbers: Iterator[tuple[int, float]], size: int) -> Response:
    """Logarithm of k s^n, of one element."""
    slopes = np.zeros((size, S.size), complex)
    at, level = next(numbers)
    slopes[at] = 1.0
    if letter != "p":
        return level + POWERS[letter] * np.log(S), slopes
    at, number = next(numbers)
    order = 1 / (1 + np.exp(-number))
    slopes[at] = order * (1 - order) * np.log(S)
    return level + order * np.log(S), slopes


def _power(tree: Tree, order: float, end: int) -> float:
    """Power of s far above (end 1) or far below (-1) all corners; springpots have an order."""
    if isinstance(tree, str):
        return POWERS.get(tree, order)
    sign = end if tree[0] == "|" else -end
    return sign * max(sign * _power(part, order, end) for part in tree[1:])


def _real(values: Any) -> Any:
    """Real and imaginary parts below each other."""
    return np.concatenate([values.real, values.imag])
