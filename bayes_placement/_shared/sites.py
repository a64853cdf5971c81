"""Numbers of a tree that are still distributions: listed with their owner, sampled, replaced."""

import enum
import functools
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, TypeGuard, TypeVar, cast

import equinox as eqx
import jax
import numpy as np
import numpyro
from jax.tree_util import DictKey, GetAttrKey, PyTreeDef, SequenceKey
from numpyro.distributions import Distribution

from .arguments import check_kind, shown
from .dimensions import Parameter
from .errors import InputError
from .ranges import Range, described

Tree = TypeVar("Tree")


class Role(enum.Enum):
    """What an unknown is for."""

    PARAMETER = "parameter"
    PLACEMENT = "placement"
    RECORDING = "recording"
    OUTPUT_ERROR = "output error"
    MODEL_ERROR = "model error"


class Owner(NamedTuple):
    """The part of a tree to which an unknown belongs."""

    kind: str
    """Field that holds it: `sensor`, `actuator`, `effects`, `instrument_effects`, `damping`,
    `modes`, `noise`; empty for a tree that names no owners."""
    name: str = ""
    """Its name among those of its kind; empty where there is only one."""


class Unknown(NamedTuple):
    """One distribution in a tree."""

    owner: Owner
    """What it belongs to."""
    field: str
    """Field of the owner that it is, or is in."""
    role: Role
    """What it is for."""
    distribution: Distribution
    """Its prior."""
    unit: str
    """Unit of its value."""
    name: str
    """Its path through the tree, for people, files and NumPyro: `sensor.s1.position.x`."""
    path: tuple[str, ...] = ()
    """Words of its path within the field, none where it is all of it: `("x",)`."""
    within: Range | None = None
    """Between what numbers it can be; None where its field states nothing."""

    @property
    def component(self) -> str:
        """Its path within the field as one word, empty where it is all of it: `x`."""
        return ".".join(self.path)

    @property
    def is_placement(self) -> bool:
        """Whether it says where a sensor or an actuator is, or how it is oriented."""
        return self.role is Role.PLACEMENT

    @property
    def is_of_transducer(self) -> bool:
        """Whether it belongs to a sensor or an actuator: its placement, its gain or its delay."""
        return self.role in (Role.PLACEMENT, Role.RECORDING)


class Leaf(NamedTuple):
    """A number or a distribution in a tree; all but its value is as of an `Unknown`."""

    owner: Owner
    field: str
    name: str
    unit: str
    value: Parameter
    within: Range | None = None


class _Steps(NamedTuple):
    """What is known of a leaf after some steps along its path."""

    owner: Owner = Owner("")
    awaits_name: bool = False
    path: tuple[str, ...] = ()
    role: Role = Role.PARAMETER
    unit: str = ""
    within: Range | None = None
    stands_for: str | None = None
    law_units: Mapping[str, str] = MappingProxyType({})

    def step(self, node: object, key: object) -> "_Steps":
        """Take one more step, from a node of the tree by a key."""
        metadata = _metadata(node, key)
        word = _word(key)
        if self.awaits_name and isinstance(key, DictKey):
            return self._replace(owner=Owner(self.owner.kind, word), awaits_name=False)
        law_units = metadata[LAW_UNITS](node) if LAW_UNITS in metadata else self.law_units
        stated = stated_unit(metadata, node, self.unit)
        unit = law_units.get(stated, stated)
        within = metadata.get("within") if "unit" in metadata else self.within
        if "role" in metadata:
            return _Steps(Owner(word), awaits_name=True, role=metadata["role"], unit=unit)
        role = metadata.get("role_of_field", self.role)
        path = (*self.path, word)
        known = self._replace(
            path=path, awaits_name=False, role=role, unit=unit, within=within, law_units=law_units
        )
        field = metadata.get(STANDS_FOR)
        return known._replace(stands_for=getattr(node, field)) if field else known


LAW_UNITS = "law units"
"""Metadata of a field that holds laws: a function of the object, units by those of displacement."""

OF_ROTATION = {"N/m": "N m/rad", "N s/m": "N m s/rad", "kg": "kg m2"}
"""Units of what acts on a rotation, by those of what acts on a displacement."""

OF_MODULUS = {"N/m": "1", "N s/m": "s", "kg": "s2"}
"""Units of what is added to a modulus, over the modulus as drawn."""

STANDS_FOR = "stands for"
"""Metadata of a field that takes the place of another leaf: the field that holds its name."""


def is_unknown(leaf: object) -> TypeGuard[Distribution]:
    """Tell whether a leaf is still a distribution."""
    return isinstance(leaf, Distribution)


def is_open(leaf: object) -> bool:
    """Tell whether a leaf is no number yet: a distribution, or an input of a compiled function."""
    return is_unknown(leaf) or isinstance(leaf, jax.core.Tracer)


def is_finite(distribution: Distribution) -> bool:
    """Tell whether a distribution gives weight to finitely many values, which can be listed."""
    support = distribution.support
    return support is not None and support.is_discrete and distribution.has_enumerate_support


def unit(
    word: str | Callable[[Any], str], role: Role | None = None, *, within: Range | None = None
) -> dict[str, object]:
    """Metadata of a field whose value carries a unit, maybe a range and a role of its own.

    A unit that depends on other fields is a function of the object.
    """
    return {"unit": word, "within": within} | ({} if role is None else {"role_of_field": role})


def stated_unit(metadata: Mapping[str, object], owner: object, default: str = "") -> str:
    """Unit that the metadata of a field of an object state."""
    stated = metadata.get("unit", default)
    return str(stated(owner) if callable(stated) else stated)


def owners(role: Role) -> dict[str, Role]:
    """Metadata of a field whose value owns unknowns of a role; of a dictionary, each entry does."""
    return {"role": role}


def realise(tree: Tree, where: Callable[[Unknown], bool] = lambda unknown: True) -> Tree:
    """Sample each distribution of a tree, as a NumPyro site of its name.

    What is not asked for stays a distribution.
    """

    def sample(unknown: Unknown) -> Parameter:
        if not where(unknown):
            return unknown.distribution
        return numpyro.sample(unknown.name, unknown.distribution)

    return _mapped(tree, sample)


def substitute(tree: Tree, values: Mapping[str, object]) -> Tree:
    """Put numbers in the place of distributions, by name."""
    names = [unknown.name for unknown in unknowns(tree)]
    needed = "values by the names of unknowns are needed, since each has a name"
    instead = "experiment.fix({'structure.damping.ratio': 0.04})"
    check_kind("values", values, Mapping, needed, instead)
    strange = [name for name in values if name not in names]
    if strange:
        raise InputError(
            f"There is no unknown {strange[0]!r} to give a value to. "
            f"The unknowns are {', '.join(names) or 'none'}."
        )
    texts = [name for name, value in values.items() if isinstance(value, str | None)]
    if texts:
        raise InputError(
            f"{texts[0]}={values[texts[0]]!r} was given; a number is needed, since it takes the "
            f"place of a distribution: experiment.fix({{{texts[0]!r}: 0.04}})."
        )
    return _mapped(tree, lambda unknown: values.get(unknown.name, unknown.distribution))


def settled(tree: Tree) -> Tree:
    """Put known numbers in the place of the leaves that they stand for."""
    descriptions = _descriptions(_flattened(tree)[1])
    taken = {of.taken_by for of in descriptions}
    for number, of in enumerate(descriptions):
        name = of.steps.stands_for
        if name is not None and number not in taken:
            raise InputError(
                f"{of.name} stands for {name!r}; the name of a number or of a prior of the "
                "structure is needed, each once and after what it is part of was added, since it "
                'takes the place of that: "structure.damping.ratio".'
            )
    return _mapped(tree, lambda unknown: unknown.distribution)


def unknowns(tree: object) -> list[Unknown]:
    """List the distributions of a tree in the order in which they are sampled."""
    leaves, structure = _flattened(tree)
    described_leaves = zip(_descriptions(structure), leaves, strict=True)
    return [_unknown(of, leaf) for of, leaf in described_leaves if _is_sampled(of, leaf)]


def check_numbers(tree: object, attribute: str) -> None:
    """Refuse, by an InputError, to compute an attribute of what holds distributions."""
    names = ", ".join(unknown.name for unknown in unknowns(tree))
    if names:
        raise InputError(
            f"{attribute} of {type(tree).__name__} was asked for, and a distribution stands for "
            f"{names}; numbers are needed, since each value gives another one. Take "
            f"experiment.nominal().structure.modes.{attribute}, or write numbers."
        )


def leaves_with_unit(tree: object) -> list[Leaf]:
    """List numbers and distributions of a tree whose fields have a unit, with their paths."""
    leaves, structure = _flattened(tree)
    described_leaves = zip(_descriptions(structure), leaves, strict=True)
    return [_leaf(of, leaf) for of, leaf in described_leaves if of.steps.unit]


def _mapped(tree: Tree, function: Callable[[Unknown], object]) -> Tree:
    """Replace each distribution by the value of a function of the unknown."""
    leaves, structure = _flattened(tree)
    descriptions = _descriptions(structure)
    mapped = [
        function(_unknown(of, leaf)) if _is_sampled(of, leaf) else leaf
        for of, leaf in zip(descriptions, leaves, strict=True)
    ]
    for place, of in enumerate(descriptions):
        if of.taken_by is not None and not is_unknown(mapped[of.taken_by]):
            mapped[place] = mapped[of.taken_by]
    return cast(Tree, jax.tree.unflatten(structure, mapped))


class _Description(NamedTuple):
    """What is known of a leaf from its place in a tree, and which leaf stands for it."""

    steps: _Steps
    name: str
    taken_by: int | None = None


def _is_sampled(of: _Description, leaf: object) -> bool:
    """Whether a leaf is a distribution that no other leaf stands for."""
    return isinstance(leaf, Distribution) and of.taken_by is None


def _flattened(tree: object) -> tuple[list[Any], PyTreeDef]:
    """Leaves of a tree, a distribution being one, and its structure."""
    return jax.tree.flatten(tree, is_leaf=lambda leaf: isinstance(leaf, Distribution))


def _descriptions(structure: PyTreeDef) -> tuple[_Description, ...]:
    """Description of each leaf of a structure: trees of one structure are asked for many times."""
    try:
        return _kept_descriptions(structure)
    except (TypeError, ValueError):  # fixed fields that cannot be compared, such as arrays
        return _new_descriptions(structure)


def _new_descriptions(structure: PyTreeDef) -> tuple[_Description, ...]:
    tree = jax.tree.unflatten(structure, range(structure.num_leaves))
    paths = [path for path, _ in jax.tree_util.tree_flatten_with_path(tree)[0]]
    plain = [
        _Description(_steps(tree, path), ".".join(_word(key) for key in path)) for path in paths
    ]
    for number, of in enumerate(plain):
        if of.steps.stands_for is not None:
            _stand_in(plain, number)
    return tuple(plain)


def _stand_in(descriptions: list[_Description], number: int) -> None:
    """Let a leaf stand for another one, whose unit and range it has."""
    of = descriptions[number]
    for place, other in enumerate(descriptions):
        # In a part of a tree, such as a structure alone, names are shorter.
        if f".{of.steps.stands_for}".endswith(f".{other.name}"):
            descriptions[place] = other._replace(taken_by=number)
            known = other.steps.unit, other.steps.within
            steps = of.steps._replace(unit=known[0], within=known[1])
            descriptions[number] = of._replace(steps=steps)


_kept_descriptions = functools.lru_cache(maxsize=512)(_new_descriptions)


def _unknown(of: _Description, leaf: Distribution) -> Unknown:
    steps = of.steps
    field, *path = steps.path or ("",)
    known = (steps.owner, field, steps.role, leaf, steps.unit, of.name)
    return Unknown(*known, tuple(path), steps.within)


def _leaf(of: _Description, leaf: object) -> Leaf:
    steps = of.steps
    field = (steps.path or ("",))[0]
    return Leaf(steps.owner, field, of.name, steps.unit, leaf, steps.within)


def _steps(tree: object, path: tuple[object, ...]) -> _Steps:
    """What is known of a leaf at the end of its path."""
    node, steps = tree, _Steps()
    for key in path:
        steps = steps.step(node, key)
        node = _child(node, key)
    return steps


def _metadata(node: object, key: object) -> Mapping[str, Any]:
    if not (isinstance(key, GetAttrKey) and isinstance(node, eqx.Module)):
        return {}
    return node.__dataclass_fields__[key.name].metadata


def _child(node: Any, key: object) -> object:
    if isinstance(key, GetAttrKey):
        return getattr(node, key.name)
    if isinstance(key, DictKey):
        return node[key.key]
    return node[key.idx] if isinstance(key, SequenceKey) else None


def _word(key: object) -> str:
    if isinstance(key, GetAttrKey):
        return key.name
    if isinstance(key, DictKey):
        return str(key.key)
    if isinstance(key, SequenceKey):
        return str(key.idx + 1)  # people count modes from one
    return str(key)


def check_scalar(name: str, value: object) -> None:
    """Refuse several numbers, or a distribution of several, in the place of one."""
    if isinstance(value, list | tuple | dict):
        words = shown(value)
    elif isinstance(value, jax.core.Tracer) or not _shape(value):
        return
    else:
        given = described(value) if is_unknown(value) else shown(value)
        words = f"{given} of shape {_shape(value)}"
    raise InputError(
        f"{name}={words} was given; one number or a distribution of one number is needed, since it "
        f"is a single quantity and not one for each line or mode: {name}=0.5."
    )


def _shape(value: Any) -> tuple[int, ...]:
    return tuple(value.shape()) if is_unknown(value) else np.shape(value)
