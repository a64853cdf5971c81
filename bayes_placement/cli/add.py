"""`bayes-placement add`: a model with one effect more, whose numbers are typed."""

import dataclasses
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from numpyro import distributions

from .._shared.errors import UsageError
from .._shared.files import write_atomically
from ..effects import EFFECTS, Effect
from ..effects.library import unknown_effect
from ._inputs import read_study
from ._save import IMPORTS, effect_as_typed, from_folder_of, imports_of
from ._terminal import command_on

HEAD = '''\
"""The model of {model}, and {effect}; written by bayes-placement add."""

{imports}
HERE = Path(__file__).parent

study = bp.io.{reader}.read(HERE / {path!r})
measurement = study.measurement
experiment = study.experiment + {call}
'''

NUMBERS = re.compile(r"[-+.\de]+(?:,[-+.\de]+)*", re.IGNORECASE)
"""A number, or several with commas."""

PRIOR = re.compile(r"([A-Z]\w*)\(([-+.\de, ]+)\)")
"""A distribution of plain numbers."""


def run(model: Path, word: str, typed: Sequence[str], save: Path) -> str:
    """Write a model file with an effect, and return what to do with it.

    Numbers are as they were typed: `--mass`, `0.5` and so on.
    """
    if save.exists() or save.suffix != ".py":
        fault = "is there already" if save.exists() else "is no name of a Python file"
        raise UsageError(
            f"--save {save} was given, which {fault}; a new file is needed, since nothing is "
            f"replaced: --save {model.stem}_{word}.py."
        )
    effect = _made(word, dict(_pairs(typed)))
    study = read_study(model)
    study.experiment + effect  # refuses what does not fit the structure
    call = effect_as_typed(effect)
    text = HEAD.format(
        model=model.name,
        effect=word,
        imports=IMPORTS + imports_of(str(call)),
        reader="case" if model.is_dir() else "model",
        path=from_folder_of(save, model),
        call=call,
    )
    write_atomically(save, lambda path: path.write_text(text, encoding="utf-8"))
    return f"{model.name} with {effect!r} was written. Next: {command_on('show', save, None)}"


def _pairs(typed: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Names and values of options: `--mass 0.5` or `--mass=0.5`."""
    words = [part for word in typed for part in (word.split("=", 1) if "--" in word else [word])]
    if len(words) % 2 or not all(name.startswith("--") for name in words[::2]):
        raise UsageError(
            f"{' '.join(typed)!r} was given; each number of the effect is needed as a name and a "
            "value: --mass 0.5 --at 0.37."
        )
    for name, value in zip(words[::2], words[1::2], strict=True):
        yield name.removeprefix("--").replace("-", "_"), value


def _made(word: str, values: dict[str, str]) -> Effect:
    """The effect with its numbers."""
    kind = EFFECTS.get(word)
    if kind is None:
        raise UsageError(f"{unknown_effect(word)}.")
    fields = {field.name: field for field in dataclasses.fields(kind) if field.init}
    needed = [name for name, field in fields.items() if _is_needed(field)]
    if "law" in needed:
        raise UsageError(
            f"{word} was given; an effect of numbers is needed, since its law is typed in Python: "
            f"experiment + bp.effects.{word}(0.3, law=bp.effects.Spring(1e4))."
        )
    wrong = sorted(set(values) - set(fields)) or [name for name in needed if name not in values]
    if wrong:
        listed = " ".join(f"--{name} {_unit(fields[name])}" for name in needed)
        raise UsageError(
            f"{word} {'has no' if wrong[0] not in fields else 'needs'} --{wrong[0]}; its numbers "
            f"are needed, in SI: {listed}. Further ones: "
            f"{', '.join(name for name in fields if name not in needed)}."
        )
    numbers = {name: _value(text) for name, text in values.items()}
    for name, number in numbers.items():
        if isinstance(number, str) and "unit" in fields[name].metadata:
            raise UsageError(
                f"--{name} {number} was given; a number {_unit(fields[name])} is needed, several "
                f"with commas, or a prior: --{name} 'Uniform(0.1, 1)'."
            )
    return kind(**numbers)


def _is_needed(field: "dataclasses.Field[object]") -> bool:
    missing = dataclasses.MISSING
    return field.default is missing and field.default_factory is missing


def _unit(field: "dataclasses.Field[object]") -> str:
    unit = field.metadata.get("unit", "m" if field.name == "at" else "")
    return f"[{unit}]" if isinstance(unit, str) and unit else "..."


def _value(text: str) -> Any:
    """A number, several with commas, a prior, or a word."""
    prior = PRIOR.fullmatch(text)
    if prior and prior[1] in dir(distributions):
        return getattr(distributions, prior[1])(*map(float, prior[2].split(",")))
    if not NUMBERS.fullmatch(text):
        return text
    numbers = tuple(int(word) if word.isdigit() else float(word) for word in text.split(","))
    return numbers[0] if len(numbers) == 1 else numbers
