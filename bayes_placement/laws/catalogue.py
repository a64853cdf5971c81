"""All networks of a few elements, their one form, and families that no measurement tells apart."""

import itertools
import json
from collections import defaultdict
from collections.abc import Iterator, Sequence
from functools import cache
from typing import TypeAlias

import numpy as np
from jaxtyping import Complex, Float

from .._shared.arguments import shown
from .._shared.dimensions import ComplexSpectrum, Parameter
from .._shared.errors import InputError
from .elements import Dashpot, LossySpring, Mass, Spring, Springpot
from .law import Element, Law, Parallel, Series, Tree

ELEMENTS: dict[str, tuple[type[Element], int]] = {
    "k": (Spring, 1),
    "c": (Dashpot, 1),
    "m": (Mass, 1),
    "p": (Springpot, 2),
    "h": (LossySpring, 2),
}
"""Element of each letter, and how many numbers it takes."""

GROUPS: dict[str, type[Parallel | Series]] = {"|": Parallel, "-": Series}


def networks(letters: str, elements: int) -> list[Tree]:
    """Every irreducible network in series and parallel, each canonical form once.

    No group holds two equal elements that are one together, nor a group of its kind. Springpots may
    stand together, since their orders differ. A mass counts like any other element, by its dynamic
    stiffness alone; `is_grounded` says where all masses move against the ground. Letters are those
    of the elements, such as "kcm".

    Examples
    --------
    >>> networks("kc", 2)
    ['k', 'c', ['|', 'c', 'k'], ['-', 'c', 'k']]
    >>> len(networks("kcm", 3)), len(networks("kcmp", 3)), len(networks("kcmp", 4))
    (29, 90, 548)
    """
    _check_letters(letters)
    by_size: dict[int, list[Tree]] = {1: list(dict.fromkeys(letters))}
    for size in range(2, elements + 1):
        by_size[size] = [tree for sign in GROUPS for tree in _groups(sign, size, by_size)]
    return [tree for size in range(1, elements + 1) for tree in by_size[size]]


def is_grounded(tree: Tree) -> bool:
    """Whether every mass moves against the ground: a chain has masses in its last part alone.

    Two networks of the 29 are not, `m-(k|m)` and `m-(c|m)`; `m|(k-m)` and `m|(c-m)` are of the same
    dynamic stiffness. The order of a chain is of no consequence.
    """
    if isinstance(tree, str):
        return True
    heavy = [part for part in tree[1:] if "m" in leaves(part)]
    return (tree[0] == "|" or len(heavy) < 2) and all(is_grounded(part) for part in tree[1:])


def leaves(tree: Tree) -> list[str]:
    """Letters of the elements of a network, in its order."""
    return [tree] if isinstance(tree, str) else [leaf for part in tree[1:] for leaf in leaves(part)]


def law_of(tree: Tree, values: Sequence[Parameter]) -> Law:
    """Network of a tree, with its numbers.

    Numbers or distributions are in the order of the leaves: of a springpot stiffness and order, of
    a lossy spring stiffness and loss factor.

    Examples
    --------
    >>> law_of(["-", "k", ["|", "c", "m"]], [2e4, 40.0, 0.3])
    Spring(20000.0) - (Dashpot(40.0) | Mass(0.3))
    """
    letters = leaves(tree)
    _check_letters("".join(letters))
    needed = _numbers(tree)
    if len(values) != needed:
        raise InputError(
            f"{len(values)} values were given for the network {json.dumps(tree)}; {needed} are "
            "needed, since an element has one number, a springpot and a lossy spring two: "
            'law_of(["|", "k", "p"], [1e4, 2e4, 0.5]).'
        )
    return _law(tree, iter(values))


def classes(trees: Sequence[Tree]) -> list[list[Tree]]:
    """Networks in groups of one family of dynamic stiffness over all positive values.

    No measurement at the port tells those of a group apart. Groups and their networks are in the
    order given.

    Examples
    --------
    >>> classes(["k", ["|", "k", ["-", "c", "k"]], ["-", "k", ["|", "c", "k"]]])
    [['k'], [['|', 'k', ['-', 'c', 'k']], ['-', 'k', ['|', 'c', 'k']]]]
    """
    found: list[list[Tree]] = []
    alike: dict[tuple[float | int, ...], list[list[Tree]]] = defaultdict(list)
    for tree in trees:
        _check_letters("".join(leaves(tree)), "kcmp")
        near = alike[invariant(tree)]
        home = next((members for members in near if same_family(members[0], tree)), None)
        if home is None:
            home = []
            near.append(home)
            found.append(home)
        home.append(tree)
    return found


def _check_letters(letters: str, known: str = "".join(ELEMENTS)) -> None:
    strange = [letter for letter in letters if letter not in known]
    if strange or not letters:
        raise InputError(
            f"{shown(strange[0] if strange else letters)} was given as a letter of an element; "
            f"some of {', '.join(known)} are needed here, since networks are made of elements: "
            'networks("kcm", 3).'
        )


def _groups(sign: str, size: int, by_size: dict[int, list[Tree]]) -> list[Tree]:
    """Canonical groups of one kind, with a number of elements."""
    forms = {
        json.dumps(tree): tree
        for sizes in _partitions(size, size - 1)
        for parts in itertools.product(*(by_size[number] for number in sizes))
        if all(part[0] != sign for part in parts)
        for tree in [group(sign, parts)]
        if canonical(tree) == tree
    }
    return list(forms.values())


def _partitions(number: int, most: int) -> Iterator[list[int]]:
    """Ways to write a number as a sum, greatest part first."""
    if number == 0:
        yield []
    for first in range(min(number, most), 0, -1):
        for rest in _partitions(number - first, first):
            yield [first, *rest]


def _law(tree: Tree, values: Iterator[Parameter]) -> Law:
    """Network that takes its numbers one after the other."""
    if isinstance(tree, str):
        element, numbers = ELEMENTS[tree]
        return element(*itertools.islice(values, numbers))
    return GROUPS[tree[0]](tuple(_law(part, values) for part in tree[1:]))


POWERS = {"k": 0.0, "c": 1.0, "m": 2.0}
"""Power of s in the dynamic stiffness of an element; that of a springpot is unknown."""

# Away from the axes there are no poles, and no sum of elements leaves a sector of 120 degrees.
S = np.geomspace(1e-3, 1e3, 48) * np.exp(1j * np.pi / 3)

EQUAL = 1e-8
"""Greatest relative difference of two dynamic stiffnesses that are one."""

TARGETS, STARTS = 3, 12

Numbers = Float[np.ndarray, "number"]

Response: TypeAlias = tuple[ComplexSpectrum, Complex[np.ndarray, "number frequency"]]
"""Logarithm of the dynamic stiffness at S, and its slopes along the numbers."""


def invariant(tree: Tree) -> tuple[float | int, ...]:
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


def response(tree: Tree, numbers: Numbers | Sequence[float]) -> Response:
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


def _fits(tree: Tree, target: ComplexSpectrum, random: np.random.Generator) -> bool:
    """Whether a network has a dynamic stiffness at some values, from one of several starts."""
    return any(_distance(tree, target, _random(tree, random)) < EQUAL for _ in range(STARTS))


def _distance(tree: Tree, target: ComplexSpectrum, start: Numbers) -> float:
    """Greatest relative difference from a target after least squares."""

    def misfit(numbers: Numbers) -> Float[np.ndarray, "datum"]:
        return _real(response(tree, numbers)[0] - target)

    def slopes(numbers: Numbers) -> Float[np.ndarray, "datum number"]:
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


def _random(tree: Tree, random: np.random.Generator) -> Numbers:
    """Logarithms of values of a network, of about one."""
    return random.normal(size=_numbers(tree))


def _numbers(tree: Tree) -> int:
    return sum(ELEMENTS[letter][1] for letter in leaves(tree))


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


def _real(values: Complex[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """Real and imaginary parts below each other."""
    return np.concatenate([values.real, values.imag])


MERGING = frozenset("kcmh")
"""Letters of which two in one group are one element; springpots differ by their orders,
tables by all they hold."""


def canonical(tree: Tree) -> Tree:
    """Tree without groups in groups of their kind, without equal elements together, sorted.

    A group is such as `["|", "k", ["-", "k", "m"]]`.

    Examples
    --------
    >>> canonical(["|", "k", ["|", ["-", "m", "c"], "k"]])
    ['|', 'k', ['-', 'c', 'm']]
    """
    if isinstance(tree, str):
        return tree
    sign, *parts = tree
    flat = [inner for part in parts for inner in _joining(sign, canonical(part))]
    return group(sign, _merged(flat))


def group(sign: str, parts: Sequence[Tree]) -> Tree:
    """Group of parts in their order; one part is no group."""
    return parts[0] if len(parts) == 1 else [sign, *sorted(parts, key=json.dumps)]


def _joining(sign: str, part: Tree) -> list[Tree]:
    """Parts that a canonical tree adds to a group of a kind."""
    return part[1:] if isinstance(part, list) and part[0] == sign else [part]


def _merged(parts: Sequence[Tree]) -> list[Tree]:
    """Parts, of elements that merge one of each letter."""
    others = [part for part in parts if not (isinstance(part, str) and part in MERGING)]
    return [*sorted({part for part in parts if isinstance(part, str)} & MERGING), *others]


WORDS = {
    "k": "spring",
    "c": "dashpot",
    "m": "mass",
    "p": "springpot",
    "h": "lossy spring",
    "t": "table",
}
"""Elements in words."""


def in_words(tree: Tree) -> str:
    """Network in words, as it is typed.

    Examples
    --------
    >>> in_words(["-", ["|", "c", "k"], "m"])
    '(dashpot | spring) - mass'
    """
    if isinstance(tree, str):
        return WORDS[tree]
    sign, *parts = tree
    words = (f"({in_words(part)})" if isinstance(part, list) else in_words(part) for part in parts)
    return f" {sign} ".join(words)
