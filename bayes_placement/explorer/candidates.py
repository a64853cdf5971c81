"""Effects that can be dropped on a structure, and with which values they begin."""

from typing import NamedTuple

import numpy as np

from .._shared.errors import InputError
from .._shared.ranges import ends
from .._shared.sites import Unknown
from ..criticism.locations import locations
from ..effects.effect import Effect
from ..effects.library import EFFECTS, library
from ..experiment.experiment import Experiment
from ..inference.coordinates import Coordinates
from ..positions.places import Place, typical
from .actions import Added, with_stated
from .response import is_placed

Position = tuple[float, float, float]
"""Where a user points to [m]: x, y, z."""


class Offered(NamedTuple):
    """A kind of effect that can be added."""

    kind: str
    """Its name."""
    settings: list[str]
    """Which part or transducer each of its candidates is about, in words."""
    is_placed: bool
    """Whether it sits at a place that a user can point to."""


def offered(experiment: Experiment) -> list[Offered]:
    """Return the effects that are tried by default on an experiment, kind by kind."""
    kinds: dict[str, list[Effect]] = {}
    for effect in library(experiment).effects:
        if effect.name in EFFECTS:
            kinds.setdefault(effect.name, []).append(effect)
    return [
        Offered(kind, [_setting(experiment, effect) for effect in effects], is_placed(effects[0]))
        for kind, effects in kinds.items()
    ]


def added(
    experiment: Experiment, kind: str, number: int | None = None, at: Position | None = None
) -> Added:
    """Return what adds an effect of a kind: the candidate that can be nearest to a place.

    Candidates are numbered from 1; without a place [m] it is put in the middle of its prior.
    """
    count = len(library(experiment, [kind]).effects)
    numbers = range(1, count + 1) if number is None else [number]
    name = _free_name(experiment, kind)
    choices = []
    for candidate in numbers if at is not None else [*numbers][:1]:
        stated = {"kind": kind, "candidate": candidate, "name": name}
        together = with_stated(experiment, [stated])
        values = _begin(together, name) | placed_at(together, name, at)
        choices.append((_distance(together, name, values, at), Added(stated, values)))
    if not choices:
        raise InputError(
            f"The effect {kind!r} was chosen, but there is no candidate of it for this model; "
            "another one is needed, since it cannot act on what the model declares."
        )
    return min(choices, key=lambda choice: choice[0])[1]


def _effect(experiment: Experiment, name: str) -> Effect:
    return next(effect for effect in experiment.effects if effect.name == name)


def _unknowns(experiment: Experiment, name: str) -> list[Unknown]:
    return experiment.unknowns_of(_effect(experiment, name))


def _begin(experiment: Experiment, name: str) -> dict[str, float]:
    """Medians of the unknowns of an effect; typical values where there is no quantile."""
    unknowns = _unknowns(experiment, name)
    priors = {unknown.name: unknown.distribution for unknown in unknowns}
    try:
        coordinates = Coordinates(priors)
        named = coordinates.named(np.zeros((1, coordinates.dimension)))
        values = {word: value[0] for word, value in named.items()}
    except InputError:
        values = {word: np.asarray(typical(prior)) for word, prior in priors.items()}
    return {
        f"{word}[{number}]" if np.ndim(value) else word: each.item()
        for word, value in values.items()
        for number, each in enumerate(np.ravel(value))
    }


def placed_at(experiment: Experiment, name: str, at: Position | None) -> dict[str, float]:
    """Values of the place of an effect nearest to a position [m]; none where it has no place."""
    effect = _effect(experiment, name)
    if at is None or not is_placed(effect):
        return {}
    place = getattr(effect, effect.place_fields[0])
    nearest = place.nearest(at) if isinstance(place, Place) else {}
    values = {}
    for unknown in _unknowns(experiment, name):
        if unknown.field == "at":
            low, high = ends(unknown.distribution)
            value = nearest.get(unknown.component, np.clip(at[0], low, high))
            values[unknown.name] = np.asarray(value).item()
    return values


def _distance(
    experiment: Experiment, name: str, values: dict[str, float], at: Position | None
) -> float:
    """Distance of an effect from where it is put [m]; zero where it has no place."""
    effect = _effect(experiment, name)
    if at is None or not is_placed(effect):
        return 0.0
    arrays = {word: np.array([value]) for word, value in values.items()}
    (place,) = locations(effect, experiment, arrays, 1)
    return float(np.linalg.norm(np.where(np.isnan(place), 0.0, place - np.asarray(at))).round(9))


def _setting(experiment: Experiment, effect: Effect) -> str:
    """Which part, sensor or direction a candidate is about, in words."""
    modes = experiment.structure.modes
    return effect.on(modes).setting(modes, experiment.instruments)  # type: ignore[attr-defined]


def _free_name(experiment: Experiment, kind: str) -> str:
    """Name of one more effect of a kind."""
    taken = {effect.name for effect in experiment.effects}
    numbers = (f"{kind}_{number}" for number in range(2, len(taken) + 3))
    return next(name for name in (kind, *numbers) if name not in taken)
