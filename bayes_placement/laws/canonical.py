"""One form of networks that differ in order and grouping alone."""

import json
from collections.abc import Sequence

from .law import Tree

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
