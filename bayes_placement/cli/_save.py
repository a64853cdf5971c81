"""`--save` of `improve`: the completed model as a model file or case folder; effects as typed.

The completed model is the model with the effects that it lacked. Effects are written as a person
types them: their numbers, priors and places in plain Python.
"""

import dataclasses
import os
import re
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpyro import distributions
from numpyro.distributions import Distribution

from .._shared.errors import UsageError
from .._shared.files import write_atomically
from .._shared.ranges import described
from ..criticism.missing._parameter_estimate import spoken
from ..effects.effect import Effect
from ..effects.library import EFFECTS, kind_of
from ..experiment.experiment import Experiment
from ..io._modal_arrays import holds_modal_parameters
from ..io.case._effects import candidate_place
from ..io.case._runs import write_completed
from ..laws.elements import ELEMENTS
from ..laws.law import Law
from ..positions.places import Straight

if TYPE_CHECKING:
    from ..criticism.missing.ledger import Ledger

HEAD = '''\
"""The model of {model} with the effects it lacked: {effects}.

Written by bayes-placement improve --save. Priors of effects are scaled to the structure; what was
found stands above each, and in `found`.
"""

{imports}
HERE = Path(__file__).parent

study = bp.io.{reader}.read(HERE / {path!r})
measurement = {measurement}
experiment = {original}{model_error}
'''

IMPORTS = """\
from pathlib import Path

import bayes_placement as bp
"""

OF_MODES = "bp.observing_modes(study.experiment, measurement)"

OF_LIBRARY = """\
candidates = bp.effects.library({original}, [{kind!r}]).effects
experiment = experiment + dataclasses.replace(candidates[{number}], name={name!r})
"""
"""Lines of an effect that has no text."""

FOUND = '''\
found = {{
{lines}}}
"""Mean of each unknown that was found, in SI."""
'''

WIDTH = 100
"""Letters of a line of comment."""

DIGITS = 8
"""Digits of what was found: resonances are sharp."""


class CompletedModel(NamedTuple):
    """A model file or case folder that is to be written, beside the model that lacked something.

    No data are those of the model.
    """

    path: Path
    model: Path
    data: Path | None
    model_error: bool

    def write(self, experiment: Experiment, ledger: "Ledger") -> None:
        """Write the model as it was given, and the effects of the ledger."""
        known = {effect.name for effect in experiment.effects}
        added = [effect for effect in ledger.experiment.effects if effect.name not in known]
        last = ledger.steps[-1]
        means = {name: item.mean for name, item in last.parameters.items()}
        words = {
            effect.name: ", ".join(
                f"{spoken(word)} {item.with_interval()}"
                for word, item in last.estimates_of(effect.name).items()
            )
            for effect in added
        }
        self.write_effects(experiment, added, words, means)

    def write_effects(
        self,
        experiment: Experiment,
        added: Sequence[Effect],
        words: Mapping[str, str],
        means: Mapping[str, float],
    ) -> None:
        """Write the model as it was given, and effects.

        Words say what was found of each effect, means are values of unknowns, by name.
        """
        if not self.path.suffix:
            write_completed(self.path, self.model, experiment, added)
            return
        original = OF_MODES if self._is_modal else "study.experiment"
        parts = [
            _addition(experiment, effect, words.get(effect.name, ""), original) for effect in added
        ]
        head = self._head(added, original, "".join(parts))
        text = "\n".join([head, *parts, _found(means)])
        write_atomically(self.path, lambda path: path.write_text(text, encoding="utf-8"))

    @property
    def _is_modal(self) -> bool:
        return self.data is not None and holds_modal_parameters(self.data)

    def _head(self, added: Sequence[Effect], original: str, body: str) -> str:
        reader = "modal_parameters.read" if self._is_modal else "read_measurement"
        data = (
            f"bp.io.{reader}(HERE / {from_folder_of(self.path, self.data)!r})" if self.data else ""
        )
        of_standard = "import dataclasses\n" if "dataclasses" in body else ""
        return HEAD.format(
            model=self.model.name,
            effects=", ".join(effect.name for effect in added) or "none is claimed",
            reader="case" if self.model.is_dir() else "model",
            path=from_folder_of(self.path, self.model),
            measurement=data or "study.measurement",
            imports=of_standard + IMPORTS + imports_of(body),
            original=original,
            model_error=(
                ".with_model_error(bp.model_error.Embedded())" if self.model_error else ""
            ),
        )


def from_folder_of(new: Path, path: Path) -> str:
    """Path of a file from the folder of a new one."""
    return Path(os.path.relpath(path.resolve(), new.resolve().parent)).as_posix()


def completed_model(
    path: Path, model: Path, data: Path | None, model_error: bool
) -> CompletedModel:
    """Return a model file or case folder to be written, after a check that it replaces nothing."""
    is_case = not path.suffix and model.is_dir()
    if path.exists() or not (is_case or path.suffix == ".py"):
        fault = "is there already" if path.exists() else "is no name of a Python file"
        folder = f", or of a case folder: --save {model.name}_completed" if model.is_dir() else ""
        raise UsageError(
            f"--save {path} was given, which {fault}; a new model file is needed, since nothing is "
            f"replaced: --save {model.stem}_completed.py{folder}."
        )
    if is_case and (data is not None or model_error):
        option = "--data" if data is not None else "--model-error"
        raise UsageError(
            f"--save {path} was given beside {option}; a model file is needed then, since a case "
            f"folder holds its own data and no model error: --save {model.stem}_completed.py."
        )
    return CompletedModel(path, model, data, model_error)


def _addition(experiment: Experiment, effect: Effect, words: str, original: str) -> str:
    """Lines that add an effect as it is typed, or as one of the default candidates."""
    comment = textwrap.fill(words, initial_indent="# ", subsequent_indent="# ", width=WIDTH)
    call = effect_as_typed(effect)
    if call is None:
        number, kind = candidate_place(experiment, effect), kind_of(effect)
        lines = OF_LIBRARY.format(original=original, kind=kind, number=number, name=effect.name)
    else:
        lines = f"experiment = experiment + {call}\n"
    return f"{comment}\n{lines}" if words else lines


def _found(means: Mapping[str, float]) -> str:
    """Lines that name each unknown with its mean."""
    lines = (f"    {name!r}: {float(f'{mean:.{DIGITS}g}')},\n" for name, mean in means.items())
    return FOUND.format(lines="".join(lines))


PRIOR = re.compile(r"([A-Z]\w*)\([-+.\de, ]*\)")
"""A distribution of plain numbers."""

NAME = re.compile(r"\b([A-Z]\w*)\(")
"""What is called in a text."""


def effect_as_typed(effect: Effect) -> str | None:
    """Return the call that makes an effect, a field a line; None where a field has no text.

    Fields of their defaults are left out.
    """
    word = next((word for word, kind in EFFECTS.items() if kind is type(effect)), None)
    fields = _fields(effect)
    if word is None or fields is None:
        return None
    lines = (f"    {name}={text},\n" for name, text in fields.items())
    return f"bp.effects.{word}(\n{''.join(lines)})"


def imports_of(text: str) -> str:
    """Lines that import the distributions and the elements of laws that a text names."""
    named = {*NAME.findall(text)}
    modules = {"bayes_placement.effects": ELEMENTS, "numpyro.distributions": dir(distributions)}
    found = {module: sorted(named & {*names}) for module, names in modules.items()}
    lines = (
        f"from {module} import {', '.join(names)}\n" for module, names in found.items() if names
    )
    return "".join(lines)


def _fields(made: Effect | Straight) -> Mapping[str, str] | None:
    """Texts of the fields that are not as by default; None where one has no text."""
    texts = {
        field.name: as_typed(getattr(made, field.name))
        for field in sorted(dataclasses.fields(made), key=lambda field: bool(field.kw_only))
        if not _is_default(field, getattr(made, field.name))
    }
    known = {name: text for name, text in texts.items() if text is not None}
    return known if len(known) == len(texts) else None


def _is_default(field: "dataclasses.Field[object]", value: object) -> bool:
    plain = value is None or isinstance(value, str | int | float | tuple)
    return plain and bool(value == field.default)


def as_typed(value: object) -> str | None:
    """Return a value as text that makes it again; None where there is none."""
    if value is None or isinstance(value, bool | int | str):
        return repr(value)
    if isinstance(value, float | np.floating | np.integer):
        return repr(value.item() if isinstance(value, np.generic) else value)
    if isinstance(value, tuple | list):
        parts = [as_typed(part) for part in value]
        comma = "," if len(parts) == 1 else ""
        return None if None in parts else f"({', '.join(map(str, parts))}{comma})"
    if isinstance(value, Distribution):
        return _prior(value)
    if isinstance(value, Law):
        return _law(value)
    return _place(value) if isinstance(value, Straight) else None


def _prior(prior: Distribution) -> str | None:
    words = described(prior)
    of = PRIOR.fullmatch(words)
    return words if of and not prior.shape() and of[1] in dir(distributions) else None


def _law(law: Law) -> str | None:
    """Text of a law whose elements and priors have names."""
    known = {*ELEMENTS, *dir(distributions)}
    return repr(law) if {*NAME.findall(repr(law))} <= known else None


def _place(place: Straight) -> str | None:
    fields = _fields(place)
    if fields is None:
        return None
    arguments = ", ".join(f"{name}={text}" for name, text in fields.items())
    return f"bp.positions.{type(place).__name__}({arguments})"
