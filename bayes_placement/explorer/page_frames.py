"""Frames that a page is told: the model, curves, and the state."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..experiment.experiment import Measurements
from ..experiment.noise import Data
from .drawn_structure import structure_for_page
from .frames import packed
from .kept import KeptPage
from .response import Response, coherence_rows, measured_rows, pair_labels
from .session import Session
from .sliders import Slider, as_json

if TYPE_CHECKING:
    from .live import LivePage


class Surroundings(NamedTuple):
    """What a page is given besides model and measurement."""

    name: str
    """Name of the model."""
    baseline: Measurements | None
    """An earlier state that was measured, or None."""
    store: Path | None
    """Folder in which fits are kept, or None."""
    kept: KeptPage
    """Files in which the state is kept."""
    saves: Mapping[str, Callable[["LivePage"], Path]]
    """What can be saved, by its word: each is called with the page and returns the file."""


def model_frame(session: Session, data: Data, around: Surroundings) -> bytes:
    """Return what never changes: lines, what was measured, structure and channels."""
    experiment = session.states[0].model.experiment
    header = {
        "is": "model",
        "name": around.name,
        "words": repr(experiment),
        "pairs": pair_labels(experiment),
        "unit": experiment.observe.label,
        "structure": structure_for_page(experiment),
        "saves": list(around.saves),
    }
    arrays = {
        "frequency": np.asarray(experiment.frequency, dtype=float),
        "measured": measured_rows(experiment, data),
    }
    coherence = coherence_rows(experiment, session.measurement)
    return packed(header, arrays | ({} if coherence is None else {"coherence": coherence}))


def curves_frame(response: Response, **header: Any) -> bytes:
    """Return what a model predicts, and its error; the header names the curves and their owner."""
    arrays = {
        "predicted": response.predicted,
        "deviation": response.deviation,
        "error": response.error,
        "chi2_of_pairs": response.chi2_of_pairs,
        "chi2_of_bands": response.chi2_of_bands(),
        "places": response.places,
    }
    return packed({"is": "curves", "chi2": response.chi2, **header}, arrays)


def state_for_page(session: Session, shown: list[Slider]) -> dict[str, Any]:
    """Return numbers, effects and steps of the model at hand."""
    model = session.model
    given = {effect.name for effect in session.states[0].model.experiment.effects}
    new = [effect for effect in model.experiment.effects if effect.name not in given]
    steps = [
        {"title": state.title, "parent": state.parent, "chi2": session.chi2.get(number)}
        for number, state in enumerate(session.states)
    ]
    return {
        "sliders": as_json(shown, model.values),
        "effects": [{"name": effect.name, "kind": effect.kind} for effect in new],
        "steps": steps,
        "current": session.current,
        "path": session.path(),
        "can_undo": session.can_undo,
        "can_redo": session.can_redo,
        "script": session.script(),
    }
