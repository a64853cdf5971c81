"""Candidates of an experiment, checked before any fit."""

import dataclasses
import re
from collections.abc import Collection

from ..._shared.arguments import check_kind
from ..._shared.errors import InputError
from ..._shared.sites import unknowns
from ...effects.effect import Effect
from ...effects.instrument_effect import InstrumentEffect
from ...effects.library import Library, kind_of, library
from ...experiment._value_checks import check_values
from ...experiment.experiment import Experiment
from ...inference.coordinates import Coordinates
from ...inference.residuals_of_state import coordinates_of


def check_experiment(experiment: object, verb: str) -> None:
    """Refuse what is no experiment."""
    check_kind(
        "experiment",
        experiment,
        Experiment,
        "an experiment is needed, with structure, instruments and lines",
        f"bp.{verb}(experiment, measurement)",
    )


def candidates_of(
    experiment: Experiment, candidates: Library[Experiment] | None
) -> Library[Experiment]:
    """Effects to be tried, each of which can be added to the experiment and fitted."""
    if candidates is not None:
        check_kind(
            "candidates",
            candidates,
            Library,
            "a library of effects is needed, since each comes with its priors",
            'candidates=effects.library(experiment, ["point_mass"])',
        )
    tried = library(experiment) if candidates is None else candidates
    effects = tried.effects
    if not effects:
        raise InputError(
            "No candidate was given, so nothing can be compared. Give some: "
            "effects.library(experiment)."
        )
    names = {effect.name for effect in experiment.effects}
    coordinates_of(experiment)
    for effect in effects:
        _check(numbered(effect, names), experiment)
    return tried


def _check(effect: Effect, experiment: Experiment) -> None:
    """Refuse an effect that cannot be added or fitted; without a copy of many instruments."""
    if not isinstance(effect, InstrumentEffect) or experiment.observe.is_modal:
        coordinates_of(experiment + effect)
        return
    placed = effect.numbered(experiment.instruments).on(experiment.structure.modes)
    check_values(placed)
    Coordinates({unknown.name: unknown.distribution for unknown in unknowns(placed)})


def numbered(effect: Effect, names: Collection[str]) -> Effect:
    """Return an effect under a name that is free: point_mass, else point_mass_2 and so on."""
    if effect.name not in names:
        return effect
    kind = kind_of(effect)
    stem = kind if re.fullmatch(rf"{re.escape(kind)}_\d+", effect.name) else effect.name
    number = next(n for n in range(2, len(names) + 3) if f"{stem}_{n}" not in names)
    return renamed(effect, f"{stem}_{number}")


def renamed(effect: Effect, name: str) -> Effect:
    """Return an effect under another name."""
    return dataclasses.replace(effect, name=name)
