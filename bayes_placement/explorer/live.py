"""The model behind a page: it answers messages and hears of its workers, in one thread."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from .._shared.compiled import of_jax
from .._shared.files import Json
from ..experiment.experiment import Experiment
from ..experiment.noise import Data
from ..page.frames import packed
from .actions import Action, Drawn, Moved, Refitted, Removed, ValuedModel
from .background import Background
from .candidates import Position, added, placed_at
from .messages import Message
from .page_frames import (
    REPORT,
    Slider,
    Surroundings,
    curves_frame,
    model_frame,
    modes_for_page,
    sliders,
    state_for_page,
)
from .response import LastUsed, Response, ResponseOf, items_of
from .session import Session
from .worker import AskedOfWorker, Told, Worker, failure

if TYPE_CHECKING:
    from ..criticism.missing.fitted_model import FittedModel
    from ..criticism.missing.ledger import Ledger

NOW, DRAWN, COMPLETED = "now", "as drawn", "completed"
COMPARED = "compared"
"""Names of curves."""


class LivePage:
    """A session with its curves, workers and files.

    `around` is what it is given besides; `send` is called with each frame for the page, `post` with
    a function that is to be run in the thread of this object.
    """

    def __init__(
        self,
        session: Session,
        around: Surroundings,
        send: Callable[[bytes], None],
        post: Callable[[Callable[[], None]], None],
    ):
        self.session, self.around = session, around
        self.ledger: Ledger | None = None
        self.send = send
        self.data: Data = of_jax(session.model.experiment.data(session.measurement))
        self._response_of = LastUsed(self._compiled)
        self._sliders_of = LastUsed(sliders)
        self._shown: dict[str, bytes] = {}
        self._curves: dict[str, bytes] = {}
        self._found: dict[str, bytes] = {}
        self._begun_at = 0
        self._background = Background(self, post)
        self._at_hand = Worker(lambda told: post(lambda: self._hear_at_hand(told)))
        self._task: tuple[int, str] | None = None
        self._has_begun = False
        self._others_wait = self._is_behind = False

    def greet(self) -> None:
        """Send all that a new page needs, the present curves first."""
        self._show("model", model_frame(self.session, self.data, self.around))
        self.tell_curves(NOW, self.session.model)
        self._tell_state()
        first = self.session.states[0].model
        if DRAWN not in self._curves:
            self.tell_curves(DRAWN, first)
            self.keep()
        for frame in (*self._curves.values(), *self._found.values()):
            self.send(frame)
        self._tell_task(self._task)
        if not self._has_begun:  # once a page shows the model as drawn
            self._has_begun = True
            self._background.look_at_given()

    def greeting(self) -> list[bytes]:
        """Frames that show one more page what others show, for any thread; none at first."""
        known = [*self._shown.values(), *self._curves.values(), *self._found.values()]
        return known if "model" in self._shown else []

    def prepare(self) -> None:
        """Compile the response, which the first page needs at once."""
        self.response(self.session.model)

    def handle(self, message: Message, others_wait: bool = False) -> None:
        """Do what a page asks for; what cannot be done is told in a sentence."""
        self._others_wait = others_wait
        try:
            getattr(self, f"_on_{message.do}")(**message.content)
            if self._is_behind and not others_wait:
                self._tell_all()
        except Exception as error:  # noqa: BLE001  the page goes on, and says what happened
            self.tell("error", words=failure(error))

    def close(self) -> None:
        """End the workers and keep the state."""
        self._background.stop()
        self._at_hand.stop()
        self.keep()

    def stop(self) -> None:
        """End a task at hand, from any thread: those in line for that of the page may take long."""
        self._at_hand.stop()
        self._tell_task(None)

    def keep(self) -> None:
        """Keep the state in its file."""
        words = self.around.kept.write(self.session)
        if words:
            self.tell("error", words=words)

    def response(self, model: ValuedModel) -> Response:
        """Response of a model, compiled once for each of the structures that were last used."""
        return self._response_of(model.experiment)(model.values)

    def _compiled(self, experiment: Experiment) -> ResponseOf:
        self.tell("busy", words="A model of another structure is compiled.")
        return ResponseOf(experiment, self.data)

    # ------------------------------------------------------------ what a page asks for

    def _on_move(self, values: Mapping[str, float], serial: int) -> None:
        known = self._known(values)
        model = self.session.model
        self.tell_curves(NOW, model._replace(values={**model.values, **known}), serial)

    def _on_drag(self, effect: str, at: Position, serial: int) -> None:
        self._on_move(self._values_at(effect, at), serial)

    def _on_set(self, values: Mapping[str, float]) -> None:
        known = self._known(values)
        if known:  # a slider may tell of its last place once its effect is gone
            self._do(Moved(known))

    def _on_put(self, effect: str, at: Position) -> None:
        self._on_set(self._values_at(effect, at))

    def _on_add(self, kind: str, number: int | None, at: Position | None) -> None:
        self._do(added(self.session.model.experiment, kind, number, at))

    def _on_remove(self, effect: str) -> None:
        if self._has(effect):  # a second press may come once it is gone
            self._do(Removed(effect))

    def _on_reset(self) -> None:
        self._do(Drawn())

    def _on_undo(self) -> None:
        self.session.undo()
        self._tell_returned()

    def _on_redo(self) -> None:
        self.session.redo()
        self._tell_returned()

    def _on_go(self, state: int) -> None:
        self.session.go(state)
        self._tell_returned()

    def _on_compare(self, state: int) -> None:
        if state < len(self.session.states):
            compared = self.session.states[state]
            self.tell_curves(COMPARED, compared.model, title=f"{state}. {compared.title}")

    def _on_fit(self) -> None:
        self._begin_at_hand("fit", values=dict(self.session.model.values))

    def _on_search(self) -> None:
        self._begin_at_hand("search")

    def _on_reach(self) -> None:
        self._background.look_at_state()

    def _on_band(self, low: float, high: float) -> None:
        self._background.look_at_band((low, high))

    def _on_bound(self, low: float, high: float, serial: int) -> None:
        shares = self._background.bound((low, high))
        self.tell("bound", band=(low, high), shares=shares, serial=serial)

    def _on_port(self, acts_on: str) -> None:
        self._background.look_at_port(acts_on)

    def _on_stop(self) -> None:
        self.stop()
        self._tell_all()

    def _on_modes(self) -> None:
        self.tell("modes", **modes_for_page(self.session))

    def _on_save(self, what: str) -> None:
        given = self.around.given
        report, save = given.report, given.saves.get(what)
        if what == REPORT and report is not None:
            self._begin_at_hand(REPORT, write=report.writer(self))
        elif save is None:
            self.tell("error", words=NOT_SAVED.format(what=what))
        else:
            self.tell("busy", words=f"The {what} is written.")
            self._tell_saved(what, save(self))

    def _tell_saved(self, what: str, path: Path) -> None:
        self.tell("saved", words=f"{what.capitalize()} written: {path}")

    # ------------------------------------------------------------ workers

    def asked(self, experiment: Experiment) -> AskedOfWorker:
        """What a worker needs of a model."""
        return AskedOfWorker(
            experiment, self.session.measurement, self.around.baseline, self.around.given.fits
        )

    def _begin_at_hand(self, task: str, **further: object) -> None:
        if self._task is not None:
            return
        self._begun_at = self.session.current
        number = self._at_hand.begin(task, asked=self.asked(self._asked_for()), **further)
        self._tell_task((number, task))

    def _hear_at_hand(self, told: Told) -> None:
        """Hear of a task, unless it was stopped meanwhile."""
        number, task = self._task or (None, "")  # it may be stopped at any time
        if told.number != number:
            return
        if told.word == "progress":
            self.tell("task", task=task, share=told.content)
        elif told.word == "step":
            self._show_step(told.content)
        elif told.word == "seen":
            self.tell_curves(NOW, ValuedModel(self._asked_for(), told.content), task=task)
        else:
            self._tell_task(None)
            self._end(task, told)

    def _end(self, task: str, told: Told) -> None:
        if told.word == "failed":
            self.tell("error", words=told.content)
            self._tell_all()
        elif task == "fit":
            self.session.go(self._begun_at)  # what was done meanwhile is another branch
            self._do(Refitted(told.content))
        elif task == REPORT:
            assert self.around.given.report is not None
            self._tell_saved(task, self.around.given.report.take_over(told.content))
        else:
            self._take_over(told.content)

    def _show_step(self, step: "FittedModel") -> None:
        """Show the best model that a search has found so far."""
        from . import found

        model = found.model_of(step)
        title = " ".join(f"+ {name}" for name in step.effects) or "as given"
        self.tell_curves(NOW, model, task="search", title=f"search: {title}")

    def _take_over(self, ledger: "Ledger") -> None:
        """Make each step of a ledger a state, from the one at which the search began."""
        from . import found  # it takes long to import, and the page stands before

        self.ledger = ledger
        for action in found.actions_of(ledger, self._asked_for()):
            self.session.go(self._begun_at)
            self.session.do(action)
            response = self.response(self.session.model)
            self.session.chi2[self.session.current] = response.chi2
        self.tell_found("ledger", found.ledger_for_page(ledger))
        self._background.look_at_next(self._begun_at, ledger.alternatives)
        if ledger.steps[-1].effects:
            self.tell_curves(COMPLETED, self.session.model)
        self._tell_all()

    def _asked_for(self) -> Experiment:
        return self.session.states[self._begun_at].model.experiment

    # ------------------------------------------------------------ frames

    def _do(self, action: Action) -> None:
        model = self.session.do(action).model
        try:
            self.response(model)
        except Exception:
            self.session.take_back()
            raise
        self._tell_all()

    def _tell_returned(self) -> None:
        """Show the state that was returned to, unless more is asked for: it may be compiled."""
        self._is_behind = True
        if not self._others_wait:
            self._tell_all()

    def _tell_all(self) -> None:
        self._is_behind = False
        self.tell_curves(NOW, self.session.model)
        self._tell_state()
        self.keep()

    def _known(self, values: Mapping[str, float]) -> Mapping[str, float]:
        """Values within their ranges, of what the model has; whole where only these are meant."""
        shown = {slider.name: slider for slider in self._sliders()}
        return {
            name: _within(shown[name], value) for name, value in values.items() if name in shown
        }

    def _values_at(self, effect: str, at: Position) -> dict[str, float]:
        experiment = self.session.model.experiment
        return placed_at(experiment, effect, at) if self._has(effect) else {}

    def _has(self, effect: str) -> bool:
        return effect in (present.name for present in self.session.model.experiment.effects)

    def _sliders(self) -> list[Slider]:
        return self._sliders_of(self.session.model.experiment)

    def tell_curves(
        self, name: str, model: ValuedModel, serial: int = 0, task: str = "", title: str = ""
    ) -> None:
        """Send the curves of a model under a name."""
        response = self.response(model)
        is_state = model is self.session.model
        if is_state and name == NOW:
            self.session.chi2[self.session.current] = response.chi2
        if name == NOW and not task:
            self._background.look_beside(model, is_state)
        frame = curves_frame(
            response,
            name=name,
            title=title,
            serial=serial,
            task=task,
            is_state=is_state,
            items=items_of(model.experiment),
            added=[effect.name for effect in self.session.new_effects(model)],
            values=model.values if task else {},
        )
        if name != NOW:
            self._curves[name] = frame
        elif is_state:
            self._shown[name] = frame
        self.send(frame)

    def _tell_state(self) -> None:
        state = state_for_page(self.session, self._sliders())
        self._show("state", packed({"is": "state", **state}, {}))

    def tell_found(self, word: str, content: Json) -> None:
        """Send what was found, now and to every page that comes."""
        self._found[word] = packed({"is": word, **content}, {})
        self.send(self._found[word])

    def _tell_task(self, task: tuple[int, str] | None) -> None:
        self._task = task
        words = {"is": "task", "task": "" if task is None else task[1], "share": 0.0}
        self._show("task", packed(words, {}))

    def _show(self, word: str, frame: bytes) -> None:
        """Send a frame now, and the newest of its word to every page that comes."""
        self._shown[word] = frame
        self.send(frame)

    def tell(self, word: str, **content: object) -> None:
        """Send words and numbers without arrays."""
        self.send(packed({"is": word, **content}, {}))


NOT_SAVED = (
    "A {what} cannot be saved from here; a page of bayes-placement explore MODEL is needed, since "
    "it is written beside the model file. Copy the script instead."
)
"""What is said where something cannot be saved."""


def _within(slider: Slider, value: float) -> float:
    inside = min(max(float(value), slider.low), slider.high)
    return round(inside) if slider.is_whole else inside
