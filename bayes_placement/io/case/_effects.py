"""Effects of a case: default candidates by their kind and number, and networks at ports."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import jax

from ..._shared.errors import InputError
from ..._shared.files import Json
from ..._shared.ranges import described
from ..._shared.sites import is_unknown
from ...effects.effect import Effect
from ...effects.instrument_effect import InstrumentEffect
from ...effects.library import EFFECTS, kind_of, library
from ...experiment.experiment import Experiment
from ...laws.elements import typed
from ...modes.ports import MOTIONS
from ...positions.channel import Channel, checked
from .._gate import is_number
from ._json_fields import CaseError, FieldRule, JsonObject, choice, integer

FIELD = "effects"

NETWORKS = ("attached", "inserted", "strut")
"""Effects that are any law at a port."""


def with_effects(experiment: Experiment, case: JsonObject) -> Experiment:
    """Return the experiment with the effects that a case states, one after the other."""
    for stated in case.objects(FIELD) if case.has(FIELD) else []:
        kind = stated.value("kind", choice(*EFFECTS))
        read = _network if kind in NETWORKS else _candidate
        experiment = experiment + read(experiment, stated, kind)
    return experiment


def _candidate(experiment: Experiment, stated: JsonObject, kind: str) -> Effect:
    """One of the default candidates of a kind, under its name."""
    candidates = library(experiment, [kind]).effects
    number = stated.value("candidate", integer(1, 1))
    if number > len(candidates):
        raise CaseError(
            f"{stated.file}: the field {stated.dotted_path('candidate')} is {number}, but "
            f"there are {len(candidates)} candidates of the kind {kind}; one of these is "
            "needed there. Write 1 for the first."
        )
    return replace(candidates[number - 1], name=stated.value("name", NAME))


def _network(experiment: Experiment, stated: JsonObject, kind: str) -> Effect:
    """A network anywhere on pieces of the structure."""
    pieces = experiment.structure.modes.anywhere()
    made: Any = EFFECTS[kind]
    numbers = stated.value("pieces", _pieces(len(made.place_fields), len(pieces)))
    values = {name: stated.value(name, rule) for name, rule in SETTINGS.items() if stated.has(name)}
    settings = {name: tuple(v) if isinstance(v, list) else v for name, v in values.items()}
    law, name = typed(stated.value("law", LAW)), stated.value("name", NAME)
    return made(*(pieces[n - 1] for n in numbers), law, name=name, **settings)


def stated_effects(experiment: Experiment, effects: Sequence[Effect]) -> list[Json]:
    """Return effects, in the order in which they are added to an experiment, as a case states them.

    They are default candidates under any names, and networks at ports anywhere on a piece.
    """
    stated = []
    for effect in effects:
        state = _stated_network if type(effect).name in NETWORKS else _stated_candidate
        stated.append(state(experiment, effect) | {"name": effect.name})
        experiment = experiment + effect
    return stated


def _stated_candidate(experiment: Experiment, effect: Effect) -> Json:
    return {"kind": kind_of(effect), "candidate": 1 + candidate_place(experiment, effect)}


def _stated_network(experiment: Experiment, effect: Any) -> Json:
    pieces = [_leaves(piece) for piece in experiment.structure.modes.anywhere()]
    places = [_leaves(getattr(effect, field)) for field in effect.place_fields]
    law, has_footprint = repr(effect.law), getattr(effect, "footprint", None) is not None
    is_known = all(place in pieces for place in places) and LAW.accepts(law)
    if not is_known or has_footprint or is_unknown(effect.strength) or effect.strength != 1.0:
        raise _no_text(effect)
    values = {name: getattr(effect, name, None) for name in SETTINGS}
    settings = {name: value for name, value in values.items() if value is not None}
    numbers = [1 + pieces.index(place) for place in places]
    return {"kind": type(effect).name, "pieces": numbers, "law": law, **settings}


def candidate_place(experiment: Experiment, effect: Effect) -> int:
    """Place of an effect among the default candidates of its kind, whatever its name."""
    content = _content(effect)
    for place, candidate in enumerate(library(experiment, [kind_of(effect)]).effects):
        if content in (_content(candidate), _content(_held(candidate, experiment))):
            return place
    raise _no_text(effect)


def _held(candidate: Effect, experiment: Experiment) -> Effect:
    """An effect as an experiment holds it: on sensors and actuators by their numbers."""
    if not isinstance(candidate, InstrumentEffect):
        return candidate
    return candidate.numbered(experiment.instruments).on(experiment.structure.modes)


def _no_text(effect: Effect) -> InputError:
    return InputError(
        f"The effect {effect.name} is none of the default candidates, so it cannot be saved as "
        "text; what is added in Python is saved there: keep experiment + effect in your model file."
    )


def _content(effect: Effect) -> tuple[list[str], object]:
    """Numbers and priors of an effect, and what is fixed of it but its name."""
    return _leaves(replace(effect, name=kind_of(effect)))


def _leaves(tree: object) -> tuple[list[str], object]:
    """Numbers and priors in words, and what is fixed."""
    leaves, fixed = jax.tree.flatten(tree, is_leaf=is_unknown)
    return [described(leaf) if is_unknown(leaf) else str(leaf) for leaf in leaves], fixed


def _is_name(value: object) -> bool:
    try:
        return isinstance(value, str) and checked(Channel(value)).name == value
    except ValueError:
        return False


def _is_law(value: object) -> bool:
    try:
        return isinstance(value, str) and bool(typed(value))
    except InputError:
        return False


def _pieces(count: int, most: int) -> FieldRule:
    """Numbers of pieces of the structure, from 1."""
    words = f"a list of {count} numbers of pieces of the structure from 1 to {most}"
    numbers = range(1, most + 1)

    def accepts(value: object) -> bool:
        return isinstance(value, list) and len(value) == count and all(n in numbers for n in value)

    return FieldRule(words, [1] * count, accepts)


LAW = FieldRule(
    "a network as it is typed, with priors where numbers are unknown",
    "Spring(LogUniform(1e3, 1e6)) - Dashpot(40.0)",
    _is_law,
)
"""What hangs on a port."""

SETTINGS = {
    "motion": choice(*MOTIONS),
    "direction": FieldRule(
        "a list of three numbers",
        [0.0, 0.0, 1.0],
        lambda value: isinstance(value, list) and len(value) == 3 and all(map(is_number, value)),
    ),
}
"""What a network may have besides."""

NAME = FieldRule(
    "a name without blanks around it that does not end in a direction such as +x", "s1", _is_name
)
"""What a transducer or an effect may be called."""
