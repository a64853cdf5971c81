"""Networks of springs, dashpots and masses: their dynamic stiffness, and random ones.

A tree is the letter of an element, or a group `["|", ...]` in parallel or `["-", ...]` in series.
Letters: k spring, c dashpot, m mass against the ground, h lossy spring (stiffness, loss factor),
p springpot (stiffness at 1 rad/s, order). Independent of bayes_placement.
"""

import itertools
import json
from collections.abc import Iterator, Sequence

import numpy as np

Tree = str | list

ABSORBER = ["-", ["|", "c", "k"], "m"]

PAIRED = ("h", "p")
"""Letters of elements of two numbers, of which the second does not change with the strength."""


def dynamic_stiffness(tree: Tree, values: Sequence[float], omega: np.ndarray) -> np.ndarray:
    """Dynamic stiffness at lines [rad/s], of numbers in the order of the leaves."""
    return _of(tree, iter(values), omega)


def _of(tree: Tree, values: Iterator[float], omega: np.ndarray) -> np.ndarray:
    if isinstance(tree, str):
        return _of_element(tree, values, omega)
    parts = [_of(part, values, omega) for part in tree[1:]]
    return sum(parts) if tree[0] == "|" else 1 / sum(1 / part for part in parts)


def _of_element(letter: str, values: Iterator[float], omega: np.ndarray) -> np.ndarray:
    size, turn = next(values), 1j * omega
    if letter == "h":
        return size * (1 + 1j * next(values)) + 0 * turn
    return size * turn ** (next(values) if letter == "p" else {"k": 0, "c": 1, "m": 2}[letter])


def leaves(tree: Tree) -> list[str]:
    return [tree] if isinstance(tree, str) else [leaf for part in tree[1:] for leaf in leaves(part)]


def powers(tree: Tree) -> tuple[int, ...]:
    """Power of the strength with which each number grows."""
    return tuple(p for leaf in leaves(tree) for p in ((1, 0) if leaf in PAIRED else (1,)))


def grouped(sign: str, parts: Sequence[Tree]) -> Tree:
    """A group of parts, sorted; one part is no group."""
    return parts[0] if len(parts) == 1 else [sign, *sorted(parts, key=json.dumps)]


def networks(size: int, letters: str = "kcm") -> list[Tree]:
    """Every network of so many elements, at most three, in which no two merge into one."""
    if size == 1:
        return list(letters)
    flat = [
        grouped(sign, parts)
        for sign in "|-"
        for parts in itertools.combinations(sorted(letters), size)
    ]
    if size == 2:
        return flat
    pairs = [
        (sign, other, pair)
        for sign, other in ("|-", "-|")
        for pair in itertools.combinations(sorted(letters), 2)
    ]
    nested = [grouped(sign, [a, [other, *pair]]) for sign, other, pair in pairs for a in letters]
    return flat + nested


def is_grounded(tree: Tree) -> bool:
    """Whether every mass moves against the ground: only the last part of a chain has masses."""
    if isinstance(tree, str):
        return True
    heavy = [part for part in tree[1:] if "m" in leaves(part)]
    return (tree[0] == "|" or len(heavy) < 2) and all(is_grounded(part) for part in tree[1:])


def of_one_stiffness(tree: Tree) -> list[Tree]:
    """The tree and those that can have any dynamic stiffness that it has.

    a|(a-b) and a-(a|b) can, of any two kinds of elements: Foster's and Cauer's forms of three
    elements. Of two absorbers each may have its loss in a spring.
    """
    if tree == ["|", ABSORBER, ABSORBER]:
        lossy = ["-", "h", "m"]
        return [tree, ["|", lossy, lossy], grouped("|", [ABSORBER, lossy])]
    if isinstance(tree, str) or len(tree) != 3:
        return [tree]
    inner = [part for part in tree[1:] if isinstance(part, list)]
    alone = [part for part in tree[1:] if isinstance(part, str)]
    if len(inner) != 1 or len(inner[0]) != 3 or alone[0] not in inner[0][1:]:
        return [tree]
    return [tree, grouped(inner[0][0], [alone[0], [tree[0], *inner[0][1:]]])]


def without_one(tree: Tree, values: Sequence[float]) -> list[tuple[Tree, list[float]]]:
    """What is left once any of the elements is taken out, with its numbers."""
    return [_without(tree, list(values), number) for number in range(len(leaves(tree)))]


def _without(tree: Tree, values: list[float], gone: int) -> tuple[Tree, list[float]]:
    kept, numbers = [], iter(values)
    for number, leaf in enumerate(leaves(tree)):
        own = [next(numbers) for _ in range(2 if leaf in PAIRED else 1)]
        kept += own if number != gone else []
    return _pruned(tree, iter(range(len(leaves(tree)))), gone), kept


def _pruned(tree: Tree, order: Iterator[int], gone: int) -> Tree | None:
    if isinstance(tree, str):
        return None if next(order) == gone else tree
    parts = [part for part in (_pruned(part, order, gone) for part in tree[1:]) if part is not None]
    if not parts:
        return None
    return parts[0] if len(parts) == 1 else [tree[0], *parts]  # as they were: so are their numbers


def random_values(
    generator: np.random.Generator, tree: Tree, stiffness: float, band: tuple[float, float]
) -> tuple[float, ...]:
    """Numbers of elements that are all of about one stiffness [N/m] somewhere in a band [rad/s]."""
    return tuple(v for leaf in leaves(tree) for v in _random(generator, leaf, stiffness, band))


def _random(generator, letter: str, stiffness: float, band) -> tuple[float, ...]:
    low, high = np.log(band)
    corner = float(np.exp(low + generator.uniform(0.25, 0.75) * (high - low)))
    # Dashpots are often small: else no part of a structure would ring.
    least = -4.0 if letter == "c" else -1.0
    size = stiffness * float(np.exp(generator.uniform(least, 1.0)))
    if letter == "h":
        return size, float(np.exp(generator.uniform(np.log(0.05), np.log(0.5))))
    if letter == "p":
        order = float(generator.uniform(0.3, 0.7))
        return size / corner**order, order
    return (size / corner ** {"k": 0, "c": 1, "m": 2}[letter],)
