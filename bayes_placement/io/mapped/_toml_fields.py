"""Fields of a mapping file (TOML), each known by name and checked, with errors that name both."""

import difflib
import math
import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from ..._shared.errors import InputError
from ..._shared.files import Json
from .._gate import Accepts, existing, is_number, reading, text_in_utf8

_MOST_BYTES, _MOST_PARTS = 1 << 20, 100
_DOT = re.compile(r"(?<!\.)\.(?!\.)")


class TomlTable(NamedTuple):
    """A table of a mapping: its content, and where it stands, for messages."""

    content: Json
    place: str
    path: str = ""

    def error(self, name: str, needed: str, example: str) -> InputError:
        """Error that says what a field holds and what is needed there."""
        state = f"is {self.content[name]!r}" if name in self.content else "is missing"
        return InputError(
            f"{self.place}: {self.dotted(name)} {state}; {needed} is needed there. For example, "
            f"write {example}."
        )

    def dotted(self, name: str) -> str:
        """Path of a field."""
        return f"{self.path}.{name}" if self.path else name

    def check_known(self, known: Iterable[str]) -> None:
        """Refuse a field that is not known: a misspelt one would be ignored."""
        names = list(known)
        for name in self.content:
            if name not in names:
                nearest = difflib.get_close_matches(name, names, n=1, cutoff=0.0)[0]
                raise InputError(
                    f"{self.place}: the field {self.dotted(name)} is not known; the nearest known "
                    f'one is "{nearest}". Only known fields are taken, since a misspelt one would '
                    f"be ignored; known are {', '.join(names)}: correct its name."
                )

    def value(self, name: str, accepts: Accepts, needed: str, example: str) -> Any | None:
        """Return a field, None where it is not there."""
        if name not in self.content:
            return None
        if not accepts(self.content[name]):
            raise self.error(name, needed, example)
        return self.content[name]

    def text(self, name: str, example: str) -> str | None:
        """Return a text, None where it is not there."""
        return self.value(name, is_text, "a text", f'{name} = "{example}"')

    def number(self, name: str, example: str, least: float = -math.inf) -> float | None:
        """Return a finite number, None where it is not there."""
        above = f" of at least {least:g}" if least > -math.inf else ""
        return self.value(
            name,
            lambda value: is_number(value) and value >= least,
            f"a finite number{above}",
            f"{name} = {example}",
        )

    def table(self, name: str) -> "TomlTable | None":
        """Return a table in a field, None where it is not there."""
        content = self.value(
            name, lambda value: isinstance(value, dict), "a table", f"{name} = {{ ... }}"
        )
        return None if content is None else TomlTable(content, self.place, self.dotted(name))


def load(path: Path) -> TomlTable:
    """Read a TOML file."""
    size = existing(path, "a mapping (TOML)").stat().st_size
    with reading(path, "TOML", 'Write one field a line, such as frequency = { array = "f" }.'):
        if size > _MOST_BYTES:
            raise InputError(f"it has {size} bytes, and a mapping has at most {_MOST_BYTES}")
        text = text_in_utf8(path)
        _check_keys(text)
        content = tomllib.loads(text)
    return TomlTable(content, str(path))


def _check_keys(text: str) -> None:
    """Refuse keys of very many parts, of which tomllib keeps the square of their number."""
    if any(len(_DOT.findall(part)) > _MOST_PARTS for part in re.split(r"[,=\n]", text)):
        raise InputError(
            f"a key of it has more than {_MOST_PARTS} parts; fields of a mapping have three at most"
        )


def is_text(value: object) -> bool:
    """Whether a value is a text that is not blank."""
    return isinstance(value, str) and bool(value.strip())


def is_column(value: object) -> bool:
    """Whether a value names an array, or is the number of a column."""
    return is_text(value) or (type(value) is int and value >= 1)


def are_texts(value: object) -> bool:
    """Whether a value lists texts."""
    return isinstance(value, list) and bool(value) and all(map(is_text, value))
