"""Every effect that an experiment may be missing, with default priors."""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Generic, TypeAlias, TypeVar

from .._shared.arguments import arguments_checked
from .._shared.errors import InputError
from .._shared.reprs import with_short_repr
from . import registry
from .effect import Effect
from .scales import Scales, Setup

EFFECTS: Mapping[str, type[Effect]] = MappingProxyType(
    {word: member for word, member in vars(registry).items() if isinstance(member, type)}
)
"""Effects of the package by name, in the order of the registry."""

LISTED = "listed"
"""Word for all effects that are tried by default, without networks that are in no list."""

Tested = TypeVar("Tested", bound=Setup)

Kind: TypeAlias = str | type[Effect]
"""Name of an effect or of its kind, or the class itself."""


@with_short_repr
@dataclass(frozen=True)
class Library(Generic[Tested]):
    """Effects that an experiment may be missing.

    Parameters
    ----------
    experiment
        The experiment.
    effects
        Candidates with priors; variants of one kind have the same name.
    networks
        Whether networks of springs, dashpots and masses that are in no list are tried as well.

    Examples
    --------
    >>> bp.effects.library(experiment, ["point_mass", "time_delay"]).kinds
    ['point_mass', 'time_delay']
    """

    experiment: Tested
    effects: tuple[Effect, ...]
    networks: bool = False

    @property
    def kinds(self) -> list[str]:
        """Names of the kinds, each once."""
        return list(dict.fromkeys(candidate.name for candidate in self.effects))


@arguments_checked
def library(
    experiment: Tested,
    kinds: Iterable[Kind] | None = None,
    *,
    further: Sequence[Effect | type[Effect]] = (),
) -> Library[Tested]:
    """Collect candidates for `explain` and `improve`.

    Parameters
    ----------
    experiment
        The experiment; default priors are scaled to its structure.
    kinds
        Names of the effects to be tried; by default all that can act on it and are
        `tried_by_default`, and networks that are in no list. Where kinds are named, these alone
        are tried; `listed` names all that are tried by default, without networks.
        `compliant_support` means every model of a support that is softer than assumed,
        `soft_support` those of finite element models alone.
    further
        Effects of your own: classes, whose `suggest` is asked, or effects with priors.

    Returns
    -------
    Library
        The effects with their priors, and whether networks are tried besides.

    Raises
    ------
    InputError
        If a name is unknown.

    Examples
    --------
    >>> candidates = bp.effects.library(experiment, ["point_mass", "ground_spring"])
    >>> heaviest = max(effect.mass.high for effect in candidates.effects[:1])
    >>> round(float(heaviest), 2)  # kg, scaled to the structure
    9.0
    >>> bp.effects.library(experiment, ["listed"]).networks
    False
    """
    classes = _by_default() if kinds is None else _chosen(kinds)
    classes += [candidate for candidate in further if isinstance(candidate, type)]
    declared = [candidate for candidate in further if not isinstance(candidate, type)]
    scales = Scales(experiment)
    suggested = [
        candidate
        for kind in classes
        if kind.changes_modes or not scales.modes_alone
        for candidate in kind.suggest(scales)
    ]
    return Library(experiment, (*suggested, *declared), networks=kinds is None)


def _by_default() -> list[type[Effect]]:
    """Classes that are tried where no kinds are named."""
    return [kind for kind in EFFECTS.values() if kind.tried_by_default]


def kind_of(effect: Effect | type[Effect]) -> str:
    """Name of the kind of an effect, whatever its name in an experiment."""
    return effect.name if isinstance(effect, type) else effect.kind  # type: ignore[return-value]


def _chosen(kinds: Iterable[Kind]) -> list[type[Effect]]:
    """Classes in the order of the words, each once."""
    classes = [member for kind in kinds for member in _classes(kind)]
    return list(dict.fromkeys(classes))


def nearest_name(kind: str) -> str | None:
    """Name of the effect that is most like a word; None where none is."""
    return next(iter(_near_names(kind)), None)


def _near_names(kind: str) -> list[str]:
    """Name of the effect that is most like a word, or else those of which it is a part."""
    close = difflib.get_close_matches(kind, [*EFFECTS, LISTED], n=1)
    within = [name for name in EFFECTS if kind.lower() in name.split("_")]
    return close or difflib.get_close_matches(kind, within, n=5, cutoff=0.0)


def unknown_effect(kind: str) -> str:
    """Say that there is no such effect, which one was meant, and which there are."""
    near = " or ".join(map(repr, _near_names(kind)))
    meant = f" Did you mean {near}?" if near else ""
    known = f"{', '.join(EFFECTS)}; {LISTED} means all usual ones"
    return f"There is no effect {kind!r}.{meant} The effects are {known}"


def classes_named(kind: str) -> list[type[Effect]]:
    """Effects of this name, or of this kind, or all usual ones; none where there is no such."""
    if kind == LISTED:
        return _by_default()
    return [member for word, member in EFFECTS.items() if kind in (word, kind_of(member))]


def _classes(kind: Kind) -> list[type[Effect]]:
    """Effects of this name, or of this kind."""
    if isinstance(kind, type):
        return [kind]
    classes = classes_named(kind)
    if not classes:
        raise InputError(
            f"{unknown_effect(kind)}; one of your own is given as a class: library(experiment, "
            "further=[MyEffect])."
        )
    return classes
