"""States of a model on the page, each from the one before by an action: undo, redo, script, file.

States are never changed nor lost: one that is returned to may have several that follow from it.
"""

import json
import os
import secrets
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from .._shared.compiled import of_jax
from .._shared.errors import InputError, WritingError
from .._shared.files import Json, write_json
from ..effects.effect import Effect
from ..experiment.content_hash import content_hash
from ..experiment.experiment import Experiment, Measurements
from .actions import Action, ValuedModel, action_from
from .steps import as_drawn
from .worker import LARGE

HEAD = """\
# experiment and measurement are those that were given to bp.explore.\
"""

IMPORTS = """\
import dataclasses

import bayes_placement as bp
from bayes_placement.explorer.steps import as_drawn, chi2, fit
"""

BEGIN = "values = as_drawn(experiment)"
END = "print(chi2(experiment, measurement, values))"

SCHEMA = 1
"""Version of what a file holds."""


class SessionState(NamedTuple):
    """A model on the page."""

    model: ValuedModel
    """Experiment and values."""
    title: str
    """What was done, in words."""
    action: Action | None
    """What was done; None at the beginning."""
    parent: int | None
    """Number of the state before; None at the beginning."""


class Session:
    """What was done to a model on the page; `head` are lines of Python that make it as given."""

    def __init__(self, experiment: Experiment, measurement: Measurements, head: str = HEAD):
        self.measurement, self._head = measurement, head
        # Large arrays of NumPy would be copied for each model that is compiled.
        first = ValuedModel(of_jax(experiment, LARGE), as_drawn(experiment))
        self.states = [SessionState(first, "as drawn", None, None)]
        self.chi2: dict[int, float] = {}
        """Reduced chi-square of states by number, as far as it is known."""
        self.current = 0
        self._undone: list[int] = []

    @property
    def model(self) -> ValuedModel:
        """The model at hand."""
        return self.states[self.current].model

    def new_effects(self, model: ValuedModel) -> list[Effect]:
        """Effects of a model that were not given."""
        given = {effect.name for effect in self.states[0].model.experiment.effects}
        return [effect for effect in model.experiment.effects if effect.name not in given]

    def do(self, action: Action) -> SessionState:
        """Change the model at hand; the state before stays."""
        before = self.model
        state = SessionState(action.applied_to(before), action.title(before), action, self.current)
        self.states.append(state)
        self.current, self._undone = len(self.states) - 1, []
        return state

    def take_back(self) -> None:
        """Forget the last state, which cannot be shown."""
        self.current = self.states.pop().parent or 0

    @property
    def can_undo(self) -> bool:
        """Whether there is a state before."""
        return self.states[self.current].parent is not None

    @property
    def can_redo(self) -> bool:
        """Whether something was undone."""
        return bool(self._undone)

    def undo(self) -> None:
        """Return to the state before, if there is one."""
        parent = self.states[self.current].parent
        if parent is not None:
            self._undone.append(self.current)
            self.current = parent

    def redo(self) -> None:
        """Do again what was undone last, if anything was."""
        if self._undone:
            self.current = self._undone.pop()

    def go(self, number: int) -> None:
        """Return to a state by its number; one that is not there changes nothing."""
        if 0 <= number < len(self.states):
            self.current, self._undone = number, []

    def path(self) -> list[int]:
        """Numbers of the states that led to the present one, the first one first."""
        numbers = [self.current]
        while (parent := self.states[numbers[-1]].parent) is not None:
            numbers.append(parent)
        return numbers[::-1]

    def script(self) -> str:
        """Lines of Python that lead to the model at hand."""
        lines = [IMPORTS, self._head, "", BEGIN]
        for number in self.path():
            action = self.states[number].action
            lines += [] if action is None else action.lines()
        return "\n".join([*lines, END, ""])

    def to_json(self) -> Json:
        """Return what a file holds: every state but the first one by its action."""
        states = [
            {"parent": state.parent, "action": state.action.to_json()}
            for state in self.states
            if state.action is not None
        ]
        chi2 = [self.chi2.get(number) for number in range(len(self.states))]
        return {"schema": SCHEMA, "current": self.current, "states": states, "chi2": chi2}

    def take_up(self, content: Json) -> None:
        """Do again all that a file holds."""
        states: Sequence[Json] = content["states"]
        for state in states:
            self.go(int(state["parent"]))
            self.do(action_from(state["action"]))
        known = enumerate(content["chi2"])
        self.chi2 = {number: float(value) for number, value in known if value is not None}
        self.go(int(content["current"]))


FOLDER = "explored"
"""Folder of such files, in that of the model."""


class KeptPage(NamedTuple):
    """Files of one model and measurement."""

    folder: Path | None
    """Their folder; None where nothing is kept."""
    key: str
    """Hash of model and measurement."""

    def take_up(self, session: Session) -> str:
        """Do again in a session what a file holds; say so where it does not fit any more."""
        content = self._read("json")
        if content is None or content.get("schema") != SCHEMA:
            return ""
        try:
            session.take_up(content)
        except (InputError, LookupError, TypeError, ValueError) as error:
            return f"Not all steps of the last time were taken up: {error}"
        return ""

    def write(self, session: Session) -> str:
        """Keep a session; say so where that fails."""
        if self.folder is None:
            return ""
        try:
            write_json(self._path("json"), session.to_json())
        except WritingError as error:
            return str(error)
        return ""

    def secret(self) -> str:
        """Return the token of the address, the same after a restart; it is for the user alone."""
        if self.folder is None:
            return secrets.token_urlsafe(24)
        kept = self._read("token")
        token = (kept or {}).get("token", "")
        if isinstance(token, str) and len(token) >= 32:
            return token
        token = secrets.token_urlsafe(24)
        self._write_secret(token)
        return token

    def _write_secret(self, token: str) -> None:
        path = self._path("token")
        path.parent.mkdir(parents=True, exist_ok=True)
        # Not for other users of this machine.
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            json.dump({"token": token}, file)

    def _path(self, suffix: str) -> Path:
        assert self.folder is not None
        return self.folder / f"{self.key}.{suffix}"

    def _read(self, suffix: str) -> Json | None:
        """Content of a file; None where there is none, or none that was written in full."""
        if self.folder is None:
            return None
        try:
            content = json.loads(self._path(suffix).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return content if isinstance(content, dict) else None


def kept_page(folder: Path | None, *about: object) -> KeptPage:
    """Return the files of a model and what was measured; without a folder nothing is kept."""
    return KeptPage(folder, content_hash(*about)[:16])
