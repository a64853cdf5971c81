"""_sites: in, a tree some of whose leaves are distributions; out, their names, or numbers instead.

Not known here: what the tree describes. The name of an unknown is its path through the tree.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax
import numpyro
from jax.tree_util import DictKey, GetAttrKey, SequenceKey
from numpyro.distributions import Distribution

from ._types import InputError

Tree = TypeVar("Tree")


class Unknown(NamedTuple):
    """One distribution in a tree: its name, its law and the unit of its value."""

    name: str
    law: Distribution
    unit: str


def is_unknown(leaf: Any) -> bool:
    """Tell whether a leaf is still a distribution."""
    return isinstance(leaf, Distribution)


def is_finite(law: Any) -> bool:
    """Tell whether a law gives weight to finitely many values, which can be listed."""
    return law.support is not None and law.support.is_discrete and law.has_enumerate_support


def _word(key: Any) -> str:
    if isinstance(key, GetAttrKey):
        return key.name
    if isinstance(key, DictKey):
        return str(key.key)
    if isinstance(key, SequenceKey):
        return str(key.idx + 1)  # people count modes from one
    return str(key)


def site_name(path: tuple[Any, ...]) -> str:
    """Name of the leaf at a path: `sensor.s1.position`."""
    return ".".join(_word(key) for key in path)


def map_unknowns(tree: Tree, function: Callable[[str, Distribution], Any]) -> Tree:
    """Replace each distribution by `function(name, distribution)`."""
    return jax.tree_util.tree_map_with_path(
        lambda path, leaf: function(site_name(path), leaf) if is_unknown(leaf) else leaf,
        tree,
        is_leaf=is_unknown,
    )


def realise(tree: Tree, where: Callable[[str], bool] = lambda name: True) -> Tree:
    """Sample each distribution of a tree, as a NumPyro site named by its path.

    Parameters
    ----------
    tree
        Any tree, an `Experiment` for one.
    where
        Only the sites whose name passes are sampled; the others stay distributions.
    """
    return map_unknowns(tree, lambda name, law: numpyro.sample(name, law) if where(name) else law)


def substitute(tree: Tree, values: Mapping[str, Any]) -> Tree:
    """Put numbers in the place of the named distributions.

    Raises
    ------
    ValueError
        If a name is not an unknown of the tree.
    """
    names = [unknown.name for unknown in unknowns(tree)]
    strange = [name for name in values if name not in names]
    if strange:
        raise InputError(
            f"There is no unknown {strange[0]!r} to give a value to. "
            f"The unknowns are {', '.join(names) or 'none'}."
        )
    return map_unknowns(tree, lambda name, law: values.get(name, law))


def unknowns(tree: Any) -> list[Unknown]:
    """List the distributions of a tree in the order in which they are sampled."""
    units = dict(_units(tree, "", ""))
    leaves = jax.tree_util.tree_flatten_with_path(tree, is_leaf=is_unknown)[0]
    named = [(site_name(path), leaf) for path, leaf in leaves if is_unknown(leaf)]
    return [Unknown(name, law, units.get(name, "")) for name, law in named]


def _units(node: Any, name: str, inherited: str) -> Iterator[tuple[str, str]]:
    if is_unknown(node) or not isinstance(node, eqx.Module | dict | tuple | list):
        yield name, inherited
        return
    for word, child, child_unit in _children(node, inherited):
        yield from _units(child, f"{name}.{word}" if name else word, child_unit)


def _children(node: Any, inherited: str) -> list[tuple[str, Any, str]]:
    if isinstance(node, dict):
        return [(str(word), child, inherited) for word, child in node.items()]
    if isinstance(node, tuple | list):
        return [(str(place), child, inherited) for place, child in enumerate(node, start=1)]
    return [
        (field.name, getattr(node, field.name), field.metadata.get("unit", inherited))
        for field in dataclasses.fields(node)
        if not field.metadata.get("static", False)
    ]


def unit(word: str) -> dict[str, str]:
    """Metadata of a field of a tree whose value carries a unit."""
    return {"unit": word}
