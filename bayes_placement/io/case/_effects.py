"""Effects of a case: default candidates, by their kind and number."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import jax

from ..._ranges import described
from ..._sites import is_unknown
from ..._types import InputError
from ...effects.effect import Effect
from ...effects.library import EFFECTS, kind_of, library
from ...experiment.experiment import Experiment
from ...positions.channel import Channel, checked
from ._json_fields import CaseError, FieldRule, JsonObject, choice, integer

FIELD = "effects"


def with_effects(experiment: Experiment, case: JsonObject) -> Experiment:
    """Return the experiment with the effects that a case states, one after the other.

    Raises
    ------
    CaseError
        If one is no default candidate.
    """
    for stated in case.objects(FIELD) if case.has(FIELD) else []:
        kind = stated.value("kind", choice(*EFFECTS))
        candidates = library(experiment, [kind]).effects
        number = stated.value("candidate", integer(1, 1))
        if number > len(candidates):
            raise CaseError(
                f"{stated.file}: the field {stated.dotted_path('candidate')} is {number}, but "
                f"there are {len(candidates)} candidates of the kind {kind}; one of these is "
                "needed there. Write 1 for the first."
            )
        named = replace(candidates[number - 1], name=stated.value("name", NAME))
        experiment = experiment + named
    return experiment


def stated_effects(experiment: Experiment, effects: Sequence[Effect]) -> list[dict[str, Any]]:
    """Return effects as a case states them.

    Parameters
    ----------
    experiment
        The experiment without them.
    effects
        Default candidates under any names, in the order in which they are added.

    Raises
    ------
    InputError
        If one is no default candidate.
    """
    stated = []
    for effect in effects:
        number = 1 + candidate_place(experiment, effect)
        stated.append({"kind": kind_of(effect), "candidate": number, "name": effect.name})
        experiment = experiment + effect
    return stated


def candidate_place(experiment: Experiment, effect: Effect) -> int:
    """Place of an effect among the default candidates of its kind, whatever its name.

    Raises
    ------
    InputError
        If it is none of them.
    """
    content = _content(effect)
    for place, candidate in enumerate(library(experiment, [kind_of(effect)]).effects):
        if _content(candidate) == content:
            return place
    raise InputError(
        f"The effect {effect.name} is none of the default candidates, so it cannot be saved as "
        "text; what is added in Python is saved there: keep experiment + effect in your model file."
    )


def _content(effect: Effect) -> tuple[list[str], Any]:
    """Numbers and priors of an effect, and what is fixed of it but its name."""
    unnamed = replace(effect, name=kind_of(effect))
    leaves, fixed = jax.tree.flatten(unnamed, is_leaf=is_unknown)
    return [described(leaf) if is_unknown(leaf) else str(leaf) for leaf in leaves], fixed


def _is_name(value: Any) -> bool:
    try:
        return isinstance(value, str) and checked(Channel(value)).name == value
    except ValueError:
        return False


NAME = FieldRule(
    "a name without blanks around it that does not end in a direction such as +x", "s1", _is_name
)
"""What a transducer or an effect may be called."""
