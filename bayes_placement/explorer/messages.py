"""What a page may ask for: each message is checked field by field before anything is done."""

import json
from collections.abc import Mapping
from typing import NamedTuple

from .._shared.files import Json
from ..io._gate import Accepts, is_number

LONGEST = 16_384
"""Most letters of a message."""

MOST_VALUES, LONGEST_NAME = 256, 200
"""Most values in a message, and most letters of a name."""


class MessageError(ValueError):
    """A message that no page of ours sends."""


class Message(NamedTuple):
    """What a page asks for."""

    do: str
    """The word of what is to be done."""
    content: Json
    """Its fields."""


def _is_name(value: object) -> bool:
    return isinstance(value, str) and 0 < len(value) <= LONGEST_NAME


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1_000_000


def _is_values(value: object) -> bool:
    if not isinstance(value, dict) or not 0 < len(value) <= MOST_VALUES:
        return False
    return all(_is_name(k) and is_number(v) for k, v in value.items())


def _is_place(value: object) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(is_number, value))


def _or_none(check: Accepts) -> Accepts:
    return lambda value: value is None or check(value)


ALLOWED: Mapping[str, Mapping[str, Accepts]] = {
    "move": {"values": _is_values, "serial": _is_count},
    "drag": {"effect": _is_name, "at": _is_place, "serial": _is_count},
    "set": {"values": _is_values},
    "put": {"effect": _is_name, "at": _is_place},
    "add": {"kind": _is_name, "number": _or_none(_is_count), "at": _or_none(_is_place)},
    "remove": {"effect": _is_name},
    "undo": {},
    "redo": {},
    "go": {"state": _is_count},
    "compare": {"state": _is_count},
    "reset": {},
    "fit": {},
    "search": {},
    "reach": {},
    "band": {"low": is_number, "high": is_number},
    "bound": {"low": is_number, "high": is_number, "serial": _is_count},
    "port": {"acts_on": _is_name},
    "modes": {},
    "stop": {},
    "save": {"what": ("model", "case", "report").__contains__},
}
"""Words and fields of messages, each with what is allowed in it; all are needed."""


def parsed(text: str) -> Message:
    """Return a message."""
    if len(text) > LONGEST:
        raise MessageError("It is too long.")
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MessageError("It is no JSON.") from error
    word = content.pop("do", None) if isinstance(content, dict) else None
    fields = ALLOWED.get(word) if isinstance(word, str) else None
    if fields is None or content.keys() != fields.keys():
        raise MessageError("It is none of the messages of the page.")
    if not all(allowed(content[name]) for name, allowed in fields.items()):
        raise MessageError("A value in it is none that the page sends.")
    return Message(str(word), {name: _plain(content[name], fields[name]) for name in content})


def _plain(value: object, allowed: Accepts) -> object:
    """Numbers as floats, also those that JSON writes as whole ones; all else as it is."""
    if isinstance(value, dict):
        return {name: float(number) for name, number in value.items()}
    if isinstance(value, list):
        return tuple(map(float, value))
    return float(value) if isinstance(value, int) and allowed is is_number else value
