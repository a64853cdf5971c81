"""What can be done to a model on the page: each changes experiment or values, and is a script line.

An action is data: it is kept in a file and done again from there without anything being computed.
"""

import abc
import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar, NamedTuple

from .._shared.errors import InputError
from .._shared.files import Json
from ..experiment.experiment import Experiment
from ..experiment.model_error import Embedded
from ..inference.units import readable
from ..io.case._effects import FIELD, with_effects
from ..io.case._json_fields import JsonObject
from .steps import as_drawn

FILE = Path("explored.json")
"""What errors about a kept action name."""


class ValuedModel(NamedTuple):
    """An experiment, and a value of each of its unknowns by name."""

    experiment: Experiment
    values: Mapping[str, float]


@dataclasses.dataclass(frozen=True)
class Action(abc.ABC):
    """Something done to a model."""

    word: ClassVar[str]

    @abc.abstractmethod
    def applied_to(self, model: ValuedModel) -> ValuedModel:
        """Return the model to which it leads."""

    @abc.abstractmethod
    def lines(self) -> list[str]:
        """Lines of Python that do the same to `experiment` and `values`."""

    @abc.abstractmethod
    def title(self, before: ValuedModel) -> str:
        """Name of the step, in words."""

    def to_json(self) -> Json:
        """Return it as a file holds it."""
        return {"do": self.word, **dataclasses.asdict(self)}


@dataclasses.dataclass(frozen=True)
class Moved(Action):
    """Some unknowns have other values."""

    word = "set"
    values: Mapping[str, float]
    """These values by name."""

    def applied_to(self, model: ValuedModel) -> ValuedModel:
        """Return the model with these values."""
        return model._replace(values={**model.values, **self.values})

    def lines(self) -> list[str]:
        """One line."""
        return [f"values |= {dict(self.values)!r}"]

    def title(self, before: ValuedModel) -> str:
        """The numbers in the units in which people read them."""
        words = (value_in_words(before.experiment, *item) for item in self.values.items())
        return ", ".join(words)


@dataclasses.dataclass(frozen=True)
class Added(Action):
    """One more effect is there."""

    word = "add"
    effect: Json
    """The effect as a case states it: its kind, its number among the candidates from 1, a name."""
    values: Mapping[str, float]
    """Values of its unknowns to begin with."""

    def applied_to(self, model: ValuedModel) -> ValuedModel:
        """Return the model with the effect."""
        experiment = with_stated(model.experiment, [self.effect])
        # An attachment may bring further errors of the model, which begin as drawn.
        values = {**as_drawn(experiment), **model.values, **self.values}
        return ValuedModel(experiment, values)

    def lines(self) -> list[str]:
        """Two lines: the effect, under a name of its own where its kind has one already."""
        kind, number, name = (self.effect[word] for word in ("kind", "candidate", "name"))
        effect = f"bp.effects.library(experiment, [{kind!r}]).effects[{number - 1}]"
        named = effect if name == kind else f"dataclasses.replace({effect}, name={name!r})"
        begin = f"values = as_drawn(experiment) | values | {dict(self.values)!r}"
        return [f"experiment += {named}", begin]

    def title(self, before: ValuedModel) -> str:
        """Its name."""
        return f"+ {self.effect['name']}"


@dataclasses.dataclass(frozen=True)
class Removed(Action):
    """An effect is taken away."""

    word = "remove"
    name: str
    """Its name."""

    def applied_to(self, model: ValuedModel) -> ValuedModel:
        """Return the model without it."""
        experiment = model.experiment.without(self.name)
        # An effect may have stood for an unknown, which is there again.
        known = as_drawn(experiment)
        values = {word: model.values.get(word, drawn) for word, drawn in known.items()}
        return ValuedModel(experiment, values)

    def lines(self) -> list[str]:
        """Two lines: values that belong to nothing change nothing."""
        return [
            f"experiment = experiment.without({self.name!r})",
            "values = as_drawn(experiment) | values",
        ]

    def title(self, before: ValuedModel) -> str:
        """Its name."""
        return f"− {self.name}"  # noqa: RUF001  the sign of a difference


@dataclasses.dataclass(frozen=True)
class Drawn(Action):
    """Everything is as drawn again."""

    word = "reset"

    def applied_to(self, model: ValuedModel) -> ValuedModel:
        """Return the model at the means of its priors."""
        return model._replace(values=as_drawn(model.experiment))

    def lines(self) -> list[str]:
        """One line."""
        return ["values = as_drawn(experiment)"]

    def title(self, before: ValuedModel) -> str:
        """As the figures call it."""
        return "as drawn"


@dataclasses.dataclass(frozen=True)
class Refitted(Action):
    """The model was fitted from where it stood."""

    word = "fit"
    values: Mapping[str, float]
    """Values of the fit."""

    def applied_to(self, model: ValuedModel) -> ValuedModel:
        """Return the model with the values of the fit."""
        return model._replace(values={**model.values, **self.values})

    def lines(self) -> list[str]:
        """One line."""
        return ["values = fit(experiment, measurement, values)"]

    def title(self, before: ValuedModel) -> str:
        """As the button is called."""
        return "fit"


@dataclasses.dataclass(frozen=True)
class Improved(Action):
    """A step that `improve` found."""

    word = "search"
    step: int
    """Its number in the ledger."""
    effects: Sequence[Json]
    """Effects that are new in it, as a case states them."""
    with_model_error: bool
    """Whether the modes and channels have errors besides."""
    sizes: Mapping[str, float]
    """Sizes of these errors by name."""
    values: Mapping[str, float]
    """Values of all unknowns."""

    def applied_to(self, model: ValuedModel) -> ValuedModel:
        """Return the model with the effects that were found."""
        experiment = model.experiment
        if self.with_model_error:
            experiment = experiment.with_model_error(Embedded())
        experiment = with_stated(experiment, self.effects)
        return ValuedModel(experiment.fix(self.sizes), dict(self.values))

    def lines(self) -> list[str]:
        """Three lines, of which the first takes long."""
        return [
            "ledger = bp.improve(experiment, measurement)",
            f"step = ledger.steps[{self.step}]",
            "experiment, values = step.experiment, dict(step.values)",
        ]

    def title(self, before: ValuedModel) -> str:
        """What was found."""
        names = (f"+ {effect['name']}" for effect in self.effects)
        return f"search: {' '.join(names) or 'as given'}"


ACTIONS: dict[str, type[Action]] = {
    kind.word: kind for kind in (Moved, Added, Removed, Drawn, Refitted, Improved)
}
"""Actions by the words of files."""


def action_from(content: Json) -> Action:
    """Return an action from a file."""
    fields = dict(content)
    try:
        return ACTIONS[fields.pop("do")](**fields)
    except (KeyError, TypeError) as error:
        raise InputError(
            f"{FILE} holds {content!r:.80}, which is no step of the page; one of "
            f"{', '.join(ACTIONS)} is needed. Delete the file to begin anew."
        ) from error


def with_stated(experiment: Experiment, effects: Sequence[Json]) -> Experiment:
    """Return an experiment with effects that are stated as in a case."""
    return with_effects(experiment, JsonObject({FIELD: [dict(each) for each in effects]}, FILE))


def value_in_words(experiment: Experiment, word: str, value: float) -> str:
    """Name an unknown and its value: `mass 540 g`."""
    unknown = experiment.unknown.get(word.partition("[")[0])
    if unknown is None:
        return f"{word} {value:.4g}"
    unit = readable(unknown.unit, unknown.field, abs(value))
    owner = "" if unknown.owner.name == "" else f"{unknown.owner.name} "
    name = word.rpartition(f"{unknown.field}")[1] + word.rpartition(f"{unknown.field}")[2]
    return f"{owner}{name} {value * unit.factor:.4g} {unit.name}".rstrip()
