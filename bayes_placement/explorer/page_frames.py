"""What the page is told: structure, modes, what was measured and what a model predicts."""

import abc
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .._shared.files import Json
from .._shared.progress import Progress
from ..criticism.findings._places import outline_of, points_and_lines, shapes
from ..experiment.experiment import Experiment, Measurements
from ..experiment.noise import Data
from ..experiment.transducers import Transducer
from ..page.frames import packed
from ..positions._outlines import outline_of as tolerance_of
from ..positions.bounds import Bounds
from ..positions.vectors import unit_vector
from .response import Response, coherence_rows, measured_rows, pair_labels
from .session import KeptPage, Session
from .sliders import Slider, as_json

if TYPE_CHECKING:
    import xarray as xr

    from .live import LivePage

REPORT = "report"
"""Word of what takes long to save."""

DIGITS = 6
"""Digits of coordinates."""


def structure_for_page(experiment: Experiment) -> Json:
    """Return points [m] and lines of a structure, its transducers with axes and tolerances."""
    outline = points_and_lines(experiment)
    bounds = experiment.structure.modes.bounds()
    low, high = (np.resize(np.pad(np.atleast_1d(end), (0, 2)), 3) for end in bounds)
    return {
        "points": _rounded(outline.points),
        "lines": outline.lines.tolist(),
        "on_a_line": outline.on_a_line,
        "low": _rounded(low),
        "high": _rounded(high),
        "transducers": [
            _transducer(transducer, bounds)
            for side in (experiment.sensor, experiment.actuator)
            for transducer in side.values()
        ],
    }


def modes_for_page(session: Session) -> Json:
    """Return modes of the model at hand, and those without what was added; or those as drawn.

    With the modal assurance criterion of each shape with each of the others.
    """
    from ..criticism.check.correlation import as_channels, mac  # the page stands before

    given, model = session.states[0].model, session.model
    added = [effect.name for effect in session.new_effects(model)]
    values = {name: model.values[name] for name in given.values} if added else given.values
    outline = outline_of(given.experiment)
    now = shapes(model.experiment, model.values, outline)
    before = shapes(given.experiment, values, outline)
    return {
        "now": _modes(now),
        "before": _modes(before),
        "beside": f"without {', '.join(added)}" if added else "as drawn",
        "mac": _rounded(mac(*(as_channels(of["shape"].values) for of in (now, before)))),
    }


def _modes(found: "xr.Dataset") -> Json:
    """Natural frequencies [Hz] and mode shapes at the points of the structure."""
    shape = found["shape"].values
    largest = np.abs(shape).max(axis=(1, 2), keepdims=True, initial=0.0)
    return {
        "frequency": _rounded(found["natural_frequency"].values),
        "shape": _rounded(shape / np.where(largest > 0, largest, 1.0)),
    }


def _transducer(transducer: Transducer, bounds: Bounds) -> Json:
    place = np.atleast_1d(np.asarray(transducer.recorded, dtype=float))
    tolerance = tolerance_of(transducer.position, bounds)
    return {
        "kind": transducer.kind.lower(),
        "name": transducer.name,
        "at": _rounded(np.pad(place, (0, 3 - place.size))),
        "directions": [list(map(float, unit_vector(d))) for d in transducer.directions],
        "axes": [int(direction) for direction in transducer.directions],
        "tolerance": _rounded(np.reshape(tolerance, (-1, 3))),
    }


def _rounded(numbers: np.ndarray) -> list[object]:
    return np.round(np.asarray(numbers, dtype=float), DIGITS).tolist()


class LongSave(abc.ABC):
    """How something is saved that takes long: a worker does it."""

    @abc.abstractmethod
    def writer(self, page: "LivePage") -> Callable[[Progress], object]:
        """Return what the worker calls: it writes the page as it is now."""

    @abc.abstractmethod
    def take_over(self, written: Any) -> Path:
        """Take over what that returned, and return the file."""


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
    """What can be saved at once, by its word: each is called with the page, returns the file."""
    report: LongSave | None
    """How a report is written; None where there is none."""


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
        "saves": [*around.saves, *([] if around.report is None else [REPORT])],
    }
    arrays = {
        "frequency": np.asarray(experiment.frequency, dtype=float),
        "measured": measured_rows(experiment, data),
    }
    coherence = coherence_rows(experiment, session.measurement)
    return packed(header, arrays | ({} if coherence is None else {"coherence": coherence}))


def curves_frame(response: Response, **header: object) -> bytes:
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


def state_for_page(session: Session, shown: list[Slider]) -> Json:
    """Return numbers, effects and steps of the model at hand."""
    model = session.model
    steps = [
        {"title": state.title, "parent": state.parent, "chi2": session.chi2.get(number)}
        for number, state in enumerate(session.states)
    ]
    return {
        "sliders": as_json(shown, model.values),
        "effects": [
            {"name": effect.name, "kind": effect.kind} for effect in session.new_effects(model)
        ],
        "steps": steps,
        "current": session.current,
        "path": session.path(),
        "can_undo": session.can_undo,
        "can_redo": session.can_redo,
        "script": session.script(),
    }
