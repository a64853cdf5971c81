"""All networks of a few elements, and which of them no measurement tells apart."""

import itertools
import json
from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import Any

from .._shared.arguments import shown
from .._shared.errors import InputError
from .canonical import canonical, group
from .elements import Dashpot, LossySpring, Mass, Spring, Springpot
from .families import invariant, same_family
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


def law_of(tree: Tree, values: Sequence[Any]) -> Law:
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
    needed = sum(ELEMENTS[letter][1] for letter in letters)
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
    alike: dict[Any, list[list[Tree]]] = defaultdict(list)
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


def _law(tree: Tree, values: Iterator[Any]) -> Law:
    """Network that takes its numbers one after the other."""
    if isinstance(tree, str):
        element, numbers = ELEMENTS[tree]
        return element(*itertools.islice(values, numbers))
    return GROUPS[tree[0]](tuple(_law(part, values) for part in tree[1:]))
