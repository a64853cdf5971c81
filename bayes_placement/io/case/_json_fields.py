"""_fields: in, a JSON file; out, its fields, each checked against what is allowed there.

Not known here: structures, measurements, what a field is for.
"""

import difflib
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from ..._types import InputError


class CaseError(InputError):
    """A case folder that does not describe one whole, unambiguous experiment."""


class Rule(NamedTuple):
    """What is allowed in a field, in words, by example and as a test."""

    needed: str
    example: Any
    accepts: Callable[[Any], bool]


class Fields(NamedTuple):
    """A JSON object: its content, the file, its dotted path there and the name that it bears."""

    content: dict[str, Any]
    file: Path
    path: str = ""
    label: str = ""

    def take(self, name: str, rule: Rule) -> Any:
        """Return a required field.

        Raises
        ------
        CaseError
            If it is missing, or something else than the rule allows.
        """
        if name not in self.content:
            raise CaseError(
                f"{self.file} has no field {self.place(name)}; {rule.needed} is needed there. "
                f"{self._similar(name)}Write {_written(name, rule.example)}."
            )
        value = self.content[name]
        if not rule.accepts(value):
            raise self.wrong(name, rule)
        return value

    def wrong(self, name: str, rule: Rule) -> CaseError:
        """Error that says what a field holds and what it should."""
        return CaseError(
            f"{self.file}: the field {self.place(name)} is {_shown(self.content[name])}; "
            f"{rule.needed} is needed there. For example, write {_written(name, rule.example)}."
        )

    def place(self, name: str) -> str:
        """Dotted path of a field: sensors[2].tolerance_m, with the name of its object."""
        whole = f"{self.path}.{name}" if self.path else name
        return f'{whole} of "{self.label}"' if self.label else whole

    def inside(self, name: str) -> "Fields":
        """Return the object in a required field.

        Raises
        ------
        CaseError
            If it is missing or no object.
        """
        rule = Rule("an object {...}", {}, lambda value: isinstance(value, dict))
        path = f"{self.path}.{name}" if self.path else name
        return Fields(self.take(name, rule), self.file, path)

    def each(self, name: str, *, least: int = 0) -> list["Fields"]:
        """Return the objects in a required field that lists them.

        Raises
        ------
        CaseError
            If it is missing, no list of objects, or shorter than `least`.
        """
        at_least = f" with at least {least} entry" if least else ""
        rule = Rule(f"a list [{{...}}] of objects{at_least}", [{}], lambda v: _objects(v, least))
        path = f"{self.path}.{name}" if self.path else name
        return [
            Fields(one, self.file, f"{path}[{index}]", _label(one))
            for index, one in enumerate(self.take(name, rule))
        ]

    def has(self, name: str) -> bool:
        """Tell whether an optional field is there and not null."""
        return self.content.get(name) is not None

    def _similar(self, name: str) -> str:
        found = difflib.get_close_matches(name, self.content, n=1)
        return f'Is "{found[0]}" it, misspelt? ' if found else ""


def load(file: Path) -> Fields:
    """Read a JSON file whose whole is one object.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    CaseError
        If it is no JSON, no object, or gives a field twice.
    """
    if not file.is_file():
        raise FileNotFoundError(
            f"There is no file {file}. A case is a folder with case.json and measured.uff; give "
            "that folder."
        )
    try:
        content = json.loads(file.read_text("utf-8-sig"), object_pairs_hook=_once)
    except json.JSONDecodeError as error:
        raise CaseError(
            f"{file} is no JSON: {error.msg} in line {error.lineno}, column {error.colno}. "
            "Correct it there; a comma may be missing or left over just before."
        ) from error
    except ValueError as error:  # a field given twice, or bytes that are no UTF-8
        raise CaseError(f"{file} cannot be read: {error}. Correct it there.") from error
    if not isinstance(content, dict):
        raise CaseError(
            f"{file} holds {_shown(content)}; one object {{...}} with the fields of a case is "
            'needed: {"structure": {...}, "sensors": [...], ...}.'
        )
    return Fields(content, file)


def distinct(name: str, objects: list[Fields]) -> None:
    """Refuse objects that share the value of a field.

    Raises
    ------
    CaseError
        If two of them do.
    """
    for index, one in enumerate(objects):
        value = one.content[name]
        for other in objects[:index]:
            if other.content[name] == value:
                raise CaseError(
                    f"{one.file}: {other.place(name)} and {one.place(name)} are both "
                    f"{_shown(value)}; each needs its own, since either could be meant. Correct "
                    "the one that is wrong, or leave it out."
                )


def positive(unit: str, example: float, most: float = math.inf) -> Rule:
    """Allow a number above zero, and below a bound if there is one."""
    below = f" below {most:g}" if most < math.inf else ""
    return Rule(
        f"a positive number [{unit}]{below}",
        example,
        lambda value: is_number(value) and 0 < value < most,
    )


def between(low: float, high: float, unit: str, example: float) -> Rule:
    """Allow a number between two bounds, which are allowed themselves."""
    return Rule(
        f"a number [{unit}] from {low:g} to {high:g}",
        example,
        lambda value: is_number(value) and low <= value <= high,
    )


def whole(least: int, example: int) -> Rule:
    """Allow a whole number of some least value."""
    return Rule(
        f"a whole number of at least {least}",
        example,
        lambda value: type(value) is int and value >= least,
    )


def begins_with(words: str) -> Rule:
    """Allow a text that begins with some words."""
    return Rule(
        f"a text that begins with {_shown(words)}",
        words,
        lambda value: isinstance(value, str) and value.startswith(words),
    )


def one_of(*words: str) -> Rule:
    """Allow one of some texts, word for word."""
    listed = " or ".join(_shown(word) for word in words)
    return Rule(listed, words[0], lambda value: isinstance(value, str) and value in words)


def numbers(needed: str, example: list[float] | list[int], accepts: Callable[[Any], bool]) -> Rule:
    """Allow a list of numbers of the length of the example that passes a test."""
    return Rule(
        needed,
        example,
        lambda value: (
            isinstance(value, list)
            and len(value) == len(example)
            and all(map(is_number, value))
            and accepts(value)
        ),
    )


def is_number(value: Any) -> bool:
    """Tell whether a JSON value is a finite number."""
    return isinstance(value, int | float) and type(value) is not bool and math.isfinite(value)


def _objects(value: Any, least: int) -> bool:
    listed = isinstance(value, list) and len(value) >= least
    return listed and all(isinstance(one, dict) for one in value)


def _label(content: dict[str, Any]) -> str:
    found = content.get("id", content.get("name"))
    return found if isinstance(found, str) else ""


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    names = [name for name, _ in pairs]
    twice = [name for index, name in enumerate(names) if name in names[:index]]
    if twice:
        raise InputError(
            f'the field "{twice[0]}" stands twice in one object, and either could be meant'
        )
    return dict(pairs)


def _shown(value: Any) -> str:
    shown = json.dumps(value, ensure_ascii=False)
    return shown if len(shown) <= 80 else f"{shown[:77]}..."


def _written(name: str, example: Any) -> str:
    return f'"{name}": {json.dumps(example, ensure_ascii=False)}'
