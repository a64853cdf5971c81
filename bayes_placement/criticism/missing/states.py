"""Ledger of several states of one structure: what is new in each, and how it grows."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from ..._shared.files import Json, write_json
from ..._shared.reprs import notebook_html
from ._change_between_states import CHANGED, NEW, UNCHANGED, FoundEffect, change
from ._narrow_text import narrow_by_column
from ._parameter_estimate import ParameterEstimate, spoken
from ._verdict_in_words import alone_in_words
from .ledger import Ledger, misfit_columns


class EffectInState(NamedTuple):
    """An effect in one state, `new`, `changed` or `unchanged` since it was last found."""

    found: FoundEffect
    change: str

    def size(self, form: Callable[[ParameterEstimate], str] = str) -> str:
        """Its unknowns but the place, in words."""
        return self._in_words(form, are_places=False) or "present"

    def place(self, form: Callable[[ParameterEstimate], str] = str) -> str:
        """Its place in words; empty where it has none."""
        return self._in_words(form, are_places=True)

    def _in_words(self, form: Callable[[ParameterEstimate], str], *, are_places: bool) -> str:
        fields = self.found.effect.place_fields
        return ", ".join(
            f"{spoken(word)} {form(estimate)}"
            for word, estimate in self.found.estimates.items()
            if (estimate.field in fields) == are_places
        )


class Course(NamedTuple):
    """One effect through the states, by the label of each in which it was found."""

    in_state: Mapping[str, EffectInState]

    @property
    def last(self) -> FoundEffect:
        """The effect as it was found last."""
        return [*self.in_state.values()][-1].found

    @property
    def kind(self) -> str:
        """Kind of the effect."""
        return self.last.kind

    def title(self) -> str:
        """Kind, setting and place; the place of the last state, where damage is mostly largest."""
        which = self.which(ParameterEstimate.with_interval)
        return " ".join(filter(None, [self.kind, which]))

    def which(self, form: Callable[[ParameterEstimate], str] = str) -> str:
        """Setting and place of the last state."""
        last = [*self.in_state.values()][-1]
        return " ".join(filter(None, [self.last.setting, last.place(form)]))

    def cell(self, label: str) -> str:
        """Its size in a state with 95 % intervals, and what became of it; empty without it."""
        here = self.in_state.get(label)
        if here is None:
            return ""
        return f"{here.size(ParameterEstimate.with_interval)}, {here.change}"


@dataclass(frozen=True, repr=False)
class LedgerOfStates:
    """What is new in each of several states of one structure.

    Parameters
    ----------
    baseline
        Label of the first state, which all others are compared with.
    ledgers
        Ledger of each later state against the baseline, by label.
    courses
        Every effect that was found, through the states.

    Examples
    --------
    >>> later.new
    {'a year later': ('point_mass',)}
    """

    baseline: str
    ledgers: Mapping[str, Ledger]
    courses: tuple[Course, ...]

    @property
    def new(self) -> dict[str, tuple[str, ...]]:
        """Kinds of effects that are new in each state, or of another size than before."""
        return {
            label: tuple(
                course.kind
                for course in self.courses
                if label in course.in_state and course.in_state[label].change != UNCHANGED
            )
            for label in self.ledgers
        }

    def table(self) -> pd.DataFrame:
        """One row for each effect with its size in each state, and the misfit that is left."""
        return pd.concat([self._effects(), self._misfit()]).rename_axis("effect")

    def _effects(self) -> pd.DataFrame:
        """Size of each effect in each state, with 95 % intervals."""
        rows = [[course.cell(label) for label in self.ledgers] for course in self.courses]
        titles = [course.title() for course in self.courses]
        return pd.DataFrame(rows, index=titles, columns=[*self.ledgers])

    def _misfit(self) -> pd.DataFrame:
        """Misfit that is left in each state."""
        columns = {label: misfit_columns(of.steps[-1]) for label, of in self.ledgers.items()}
        return pd.DataFrame(columns).fillna("")

    def words(self) -> list[str]:
        """What is new in each state, and what to doubt in it."""
        first = next(iter(self.ledgers.values()))
        sentences = [f'"{self.baseline}" is the baseline. {alone_in_words(first)}']
        before = self.baseline
        for label, ledger in self.ledgers.items():
            sentences.append(f'"{label}": {self._news(label, before)}')
            sentences += [f'"{label}": {sentence}' for sentence in ledger.words()[1:]]
            before = label
        return sentences

    def _news(self, label: str, before: str) -> str:
        """Say what is new in a state since the one before."""
        news = [_news_of(course, label, self._name_of(course)) for course in self.courses]
        parts = [part for part in news if part]
        gone = [
            self._name_of(course)
            for course in self.courses
            if before in course.in_state and label not in course.in_state
        ]
        parts += [f"{name} is no longer claimed" for name in gone]
        remark = " Something else is new as well." if self.ledgers[label].unexplained else ""
        if not parts:
            return f'nothing is claimed to be new since "{before}".{remark}'
        return f'since "{before}" {"; ".join(parts)}.{remark}'

    def _name_of(self, course: Course) -> str:
        """Kind of an effect, and which one it is where several are of the kind."""
        several = sum(other.kind == course.kind for other in self.courses) > 1
        which = course.which()
        return f"{course.kind} ({which})" if several and which else course.kind

    def to_json(self) -> Json:
        """Return it as numbers and words for a file."""
        new = self.new
        return {
            "baseline": self.baseline,
            "states": [
                {"label": label, "new": list(new[label]), "ledger": ledger.to_json()}
                for label, ledger in self.ledgers.items()
            ],
            "effects": [_course_to_json(course) for course in self.courses],
        }

    def write(self, path: str | Path) -> None:
        """Write it as JSON, whole or not at all."""
        write_json(path, self.to_json())

    def __repr__(self) -> str:
        """State what the states are compared with."""
        return f"Ledger of {len(self.ledgers)} states against {self.baseline!r}"

    def _repr_html_(self) -> str:
        verdict, *further = self.words()
        return notebook_html(verdict, self.table(), further)

    def __str__(self) -> str:
        """Table of the effects, then the sentences."""
        lines = [f"- {line}" for line in self.words()]
        return "\n".join([narrow_by_column(self._misfit().T, self._effects()), "", *lines])


def courses_of(
    effects_by_state: Mapping[str, Sequence[FoundEffect]],
    change: Callable[[FoundEffect, FoundEffect], str] = change,
) -> tuple[Course, ...]:
    """Follow each effect through the states, by their label.

    `change` says what became of an effect between two states.
    """
    courses: list[dict[str, EffectInState]] = []
    for label, effects in effects_by_state.items():
        for effect in effects:
            course, verdict = _followed(courses, label, effect, change)
            course[label] = EffectInState(effect, verdict)
    return tuple(Course(course) for course in courses)


def _followed(
    courses: list[dict[str, EffectInState]],
    label: str,
    effect: FoundEffect,
    change: Callable[[FoundEffect, FoundEffect], str],
) -> tuple[dict[str, EffectInState], str]:
    """The course that an effect belongs to, a new one where it is new, and what became of it."""
    for course in reversed(courses):
        if label not in course and _last(course).is_comparable(effect):
            verdict = change(_last(course), effect)
            if verdict != NEW:
                return course, verdict
    courses.append({})
    return courses[-1], NEW


def _last(course: Mapping[str, EffectInState]) -> FoundEffect:
    return [*course.values()][-1].found


def _news_of(course: Course, label: str, name: str) -> str:
    """Say what became of one effect of a name in a state; empty where nothing did."""
    here = course.in_state.get(label)
    if here is None or here.change == UNCHANGED:
        return ""
    if here.change == CHANGED:
        earlier = [*course.in_state]
        was = course.in_state[earlier[earlier.index(label) - 1]]
        return f"{name} is another: {here.size()} (it was {was.size()})"
    words = [here.found.setting, here.place(), here.size()]
    return f"{course.kind} is new ({', '.join(filter(None, words))})"


def _course_to_json(course: Course) -> Json:
    return {
        "kind": course.kind,
        "setting": course.last.setting,
        "states": {
            label: {
                "change": here.change,
                "parameters": {
                    word: estimate.to_json() for word, estimate in here.found.estimates.items()
                },
            }
            for label, here in course.in_state.items()
        },
    }
