"""What is looked at in the background of a page: the model as given, where laws may act, what next.

One worker does one thing after the other, so that a preview waits for a fit that is under way.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from .._shared.errors import InputError
from ..experiment.experiment import Experiment
from ..page.frames import packed
from .actions import ValuedModel
from .worker import Told, Worker

if TYPE_CHECKING:
    from ..criticism.reach.reach import Reach
    from ..inference.alternative_explanation import Alternative
    from .live import LivePage


Wanted = TypeVar("Wanted")


class Newest(Generic[Wanted]):
    """What is to be looked at, and what is: `begin` is called with it."""

    def __init__(self, begin: Callable[[Wanted], None]):
        self._begin = begin
        self._waiting: list[Wanted] = []
        self._looked: list[Wanted] = []

    def choose(self, wanted: Wanted) -> None:
        """Look at something once that before has been looked at."""
        self._waiting = [wanted]
        if not self._looked:
            self._look()

    def forget(self) -> None:
        """Look at nothing more."""
        self._waiting = []

    def ended(self) -> tuple[Wanted, bool]:
        """Return what was looked at, and whether nothing else was chosen meanwhile."""
        (looked,), self._looked = self._looked, []
        is_last = not self._waiting
        if self._waiting:
            self._look()
        return looked, is_last

    def _look(self) -> None:
        self._looked, self._waiting = self._waiting, []
        self._begin(*self._looked)


Band = tuple[float, float]
"""Least and greatest frequency [Hz]."""


def lines_within(experiment: Experiment, band: Band) -> np.ndarray:
    """Return the numbers of the lines of a band, which must be more than the unknowns."""
    frequency = np.asarray(experiment.frequency, dtype=float)
    (lines,) = np.nonzero((frequency >= band[0]) & (frequency <= band[1]))
    if lines.size <= len(experiment.unknowns):
        raise InputError(
            f"The band from {band[0]:.4g} to {band[1]:.4g} Hz was chosen, which has {lines.size} "
            f"lines; more than {len(experiment.unknowns)} are needed, since the model has so many "
            "unknowns: choose a wider one."
        )
    return lines


FITTED = "fitted as given"
"""Name of the curves of the model as given, fitted."""


class Background:
    """A worker that looks at the models of a page, and tells the page what it has found.

    `post` is called with a function that is to be run in the thread of the page.
    """

    def __init__(self, page: "LivePage", post: Callable[[Callable[[], None]], None]):
        self._page = page
        self._worker = Worker(lambda told: post(lambda: self._hear(told)))
        self._running: dict[int, tuple[str, int]] = {}
        self._reached = 0
        self._bands = Newest(self._begin_band)
        self._models, self._acts_on = Newest(self._begin_beside), ""
        self._read_by_line: Sequence[str] = ()
        self._reach: "Reach | None" = None

    def look_at_given(self) -> None:
        """Look at the model as given, and at the data."""
        for task in ("offered", "check_data", "as_given", "reach"):
            self._begin(task, 0)

    def look_at_state(self) -> None:
        """Look where laws may act beside the model at hand, all its unknowns fitted."""
        self._reached = self._page.session.current
        self._begin("reach", self._reached)

    def look_at_band(self, band: Band) -> None:
        """Look at a band beside the model of which the reach is shown; say where it is narrow."""
        experiment = self._page.session.states[self._reached].model.experiment
        try:
            self._bands.choose((band, lines_within(experiment, band)))
        except InputError as error:
            self._bands.forget()
            self._page.tell("background", task="band", share=1.0, words=str(error))

    def bound(self, band: Band) -> list[float]:
        """Return what any law could remove of a band, row by row; none where that is not known."""
        if self._reach is None or self._reach.in_bands is None:
            return []
        return self._reach.any_law_within(*band).tolist()

    def look_at_port(self, acts_on: str) -> None:
        """Look at one kind of port beside the models that follow."""
        self._acts_on = acts_on if acts_on in self._read_by_line else ""
        self.look_beside(self._page.session.model, True)

    def look_beside(self, model: ValuedModel, is_state: bool) -> None:
        """Look at what any law could remove beside a model, unless reach is of it."""
        is_reached = is_state and self._page.session.current == self._reached
        if is_reached or not self._acts_on:
            self._models.forget()
            self._page.tell("beside", acts_on="")
        else:
            self._models.choose(model)

    def look_at_next(self, state: int, alternatives: Sequence["Alternative"]) -> None:
        """Look where to measure next, by the explanations that a search has left."""
        self._page.tell("background", task="next", share=0.0)
        self._begin("next", state, alternatives=alternatives)

    def stop(self) -> None:
        """End the worker."""
        self._worker.stop()

    def _begin(self, task: str, state: int, **further: object) -> None:
        self._begin_on(self._page.session.states[state].model, task, state, **further)

    def _begin_on(self, model: ValuedModel, task: str, state: int, **further: object) -> None:
        asked = self._page.asked(model.experiment)
        self._running[self._worker.begin(task, asked=asked, **further)] = task, state

    def _begin_band(self, wanted: tuple[Band, np.ndarray]) -> None:
        self._begin("band", self._reached, lines=wanted[1])

    def _begin_beside(self, model: ValuedModel) -> None:
        further = {"acts_on": self._acts_on, "values": dict(model.values)}
        self._begin_on(model, "beside", self._page.session.current, **further)

    def _hear(self, told: Told) -> None:
        task, state = self._running[told.number]
        if told.word == "progress":
            self._page.tell("background", task=task, share=told.content)
            return
        del self._running[told.number]
        if task == "beside":
            self._end_beside(told)
        elif task == "band":
            self._end_band(told)
        elif told.word == "failed":
            self._page.tell("background", task=task, share=1.0, words=told.content)
        else:
            self._end(task, state, told.content)

    def _end(self, task: str, state: int, content: Any) -> None:
        page = self._page
        if task == "as_given":
            page.tell_curves(FITTED, page.session.states[0].model._replace(values=content))
        elif task == "offered":
            page.tell_found("palette", {"kinds": [kind._asdict() for kind in content]})
        elif task == "check_data":
            page.tell_found("faults", {"sentences": content})
        else:
            page.tell_found("next", content) if task == "next" else self._end_reach(state, content)
            page.tell("background", task=task, share=1.0)

    def _end_reach(self, state: int, content: "Reach") -> None:
        from . import found  # it takes long to import, and the page stands before

        self._reach, self._read_by_line = content, found.read_by_line(content)
        of = self._page.session.states[state].title
        told = {**found.reach_for_page(content), "of": of}
        self._page.tell_found("reach", told)

    def _end_band(self, told: Told) -> None:
        words = told.content if told.word == "failed" else ""
        self._page.tell("background", task="band", share=1.0, words=words)
        (band, _), is_last = self._bands.ended()
        if is_last and not words:
            from . import found

            self._page.tell("band", band=band, **found.reach_for_page(told.content))

    def _end_beside(self, told: Told) -> None:
        """Show reach also beside a model that was moved meanwhile: the next one follows."""
        self._models.ended()
        header, arrays = told.content if told.word == "done" else ({"acts_on": ""}, {})
        self._page.send(packed({"is": "beside", **header}, arrays))
