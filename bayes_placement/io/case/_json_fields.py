"""Fields of `case.json`: known ones alone, each by a rule; errors name file and field."""

import difflib
import json
import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ..._shared.errors import InputError
from ..._shared.files import Json
from .._gate import LARGEST, Accepts, is_number, reading, text_in_utf8

_MOST_BYTES = 16 << 20
_TEXT = re.compile(r'"(?:[^"\\]|\\.)*+"?')
_DEEPEST = 30


class CaseError(InputError):
    """A case folder with a missing, wrong or contradictory field or file.

    Examples
    --------
    >>> issubclass(bp.io.case.CaseError, ValueError)
    True
    """


class FieldRule(NamedTuple):
    """What is allowed in a field: in words, by an example, and as a test."""

    needed: str
    example: object
    accepts: Accepts


class JsonObject(NamedTuple):
    """A JSON object with its file, its dotted path in the file, and its `id` or `name`."""

    content: Json
    file: Path
    path: str = ""
    label: str = ""

    def value(self, name: str, rule: FieldRule) -> Any:
        """Return a required field."""
        if name not in self.content:
            raise CaseError(
                f"{self.file} has no field {self.dotted_path(name)}; {rule.needed} is needed "
                f"there. {self._similar(name)}Write {_written(name, rule.example)}."
            )
        value = self.content[name]
        if not rule.accepts(value):
            raise self.wrong(name, rule)
        if any(abs(number) > LARGEST for number in _numbers_in(value)):
            raise CaseError(
                f"{self.file}: the field {self.dotted_path(name)} is {_shown(value)}; numbers up "
                f"to {LARGEST:g} are needed there, since no quantity in SI is larger. Correct the "
                f"exponent: {_written(name, rule.example)}."
            )
        return value

    def wrong(self, name: str, rule: FieldRule) -> CaseError:
        """Error that says what a field holds and what is needed there."""
        return CaseError(
            f"{self.file}: the field {self.dotted_path(name)} is {_shown(self.content[name])}; "
            f"{rule.needed} is needed there. For example, write {_written(name, rule.example)}."
        )

    def dotted_path(self, name: str) -> str:
        """Path of a field, with the name of its object: sensors[2].tolerance_m of "s3"."""
        path = f"{self.path}.{name}" if self.path else name
        return f'{path} of "{self.label}"' if self.label else path

    def object(self, name: str) -> "JsonObject":
        """Return the object in a required field."""
        rule = FieldRule("an object {...}", {}, _is_object)
        path = f"{self.path}.{name}" if self.path else name
        return JsonObject(self.value(name, rule), self.file, path)

    def objects(self, name: str, *, least: int = 0) -> list["JsonObject"]:
        """Return the objects in a required field that lists them."""
        at_least = f" with at least {least} entry" if least else ""
        rule = FieldRule(
            f"a list [{{...}}] of objects{at_least}",
            [{}],
            lambda value: _are_objects(value) and len(value) >= least,
        )
        path = f"{self.path}.{name}" if self.path else name
        return [
            JsonObject(content, self.file, f"{path}[{index}]", _label(content))
            for index, content in enumerate(self.value(name, rule))
        ]

    def has(self, name: str) -> bool:
        """Tell whether an optional field is present and not null."""
        return self.content.get(name) is not None

    def _similar(self, name: str) -> str:
        similar = difflib.get_close_matches(name, self.content, n=1)
        return f'Is "{similar[0]}" it, misspelt? ' if similar else ""


def load(file: Path) -> JsonObject:
    """Read a JSON file that holds an object."""
    if not file.is_file():
        raise FileNotFoundError(
            f"There is no file {file}. A case is a folder with case.json and measured.uff; give "
            "that folder."
        )
    with reading(file, "JSON", "Copy it again."):
        content = _parsed(file)
    if not isinstance(content, dict):
        raise CaseError(
            f"{file} holds {_shown(content)}; one object {{...}} with the fields of a case is "
            'needed: {"structure": {...}, "sensors": [...], ...}.'
        )
    return JsonObject(content, file)


def _parsed(file: Path) -> object:
    """Content of a JSON file, once it is not too large or too deep."""
    if file.stat().st_size > _MOST_BYTES:
        raise CaseError(
            f"{file} has {file.stat().st_size} bytes; a case has at most {_MOST_BYTES}, since "
            "measured values stand in universal files. Give the file of the case."
        )
    try:
        text = text_in_utf8(file)
        _check_depth(text)
        return json.loads(text, object_pairs_hook=_without_duplicates)
    except json.JSONDecodeError as error:
        raise CaseError(
            f"{file} is not JSON: {error.msg} in line {error.lineno}, column {error.colno}. "
            "Correct it there; a comma may be missing or left over just before."
        ) from error
    except ValueError as error:  # a duplicate field, or text that is not UTF-8
        raise CaseError(f"{file} cannot be read: {error}. Correct it there.") from error


def _check_depth(text: str) -> None:
    """Refuse objects in objects in objects; brackets in texts do not count."""
    depth = 0
    for bracket in re.findall(r"[\[\]{}]", _TEXT.sub("", text)):
        depth += 1 if bracket in "[{" else -1
        if depth > _DEEPEST:
            raise InputError(
                f"objects and lists are nested more than {_DEEPEST} deep, and a case has "
                "no such fields"
            )


def check_distinct(name: str, objects: list[JsonObject]) -> None:
    """Refuse objects that share the value of a field."""
    for index, later in enumerate(objects):
        value = later.content[name]
        for earlier in objects[:index]:
            if earlier.content[name] == value:
                raise CaseError(
                    f"{later.file}: {earlier.dotted_path(name)} and {later.dotted_path(name)} are "
                    f"both {_shown(value)}; each needs its own, since either could be meant. "
                    "Correct the one that is wrong, or leave it out."
                )


def positive(unit: str, example: float, most: float = math.inf) -> FieldRule:
    """Allow a number above zero and below an upper bound."""
    below = f" below {most:g}" if most < math.inf else ""
    return FieldRule(
        f"a positive number [{unit}]{below}",
        example,
        lambda value: is_number(value) and 0 < value < most,
    )


def between(low: float, high: float, unit: str, example: float) -> FieldRule:
    """Allow a number between two bounds, the bounds included."""
    return FieldRule(
        f"a number [{unit}] from {low:g} to {high:g}",
        example,
        lambda value: is_number(value) and low <= value <= high,
    )


def integer(least: int, example: int) -> FieldRule:
    """Allow a whole number that is not below a least value."""
    return FieldRule(
        f"a whole number of at least {least}",
        example,
        lambda value: type(value) is int and value >= least,
    )


def begins_with(beginning: str) -> FieldRule:
    """Allow a text with a certain beginning."""
    return FieldRule(
        f"a text that begins with {_shown(beginning)}",
        beginning,
        lambda value: isinstance(value, str) and value.startswith(beginning),
    )


def choice(*texts: str) -> FieldRule:
    """Allow a text of a list, literally."""
    choices = " or ".join(_shown(text) for text in texts)
    return FieldRule(choices, texts[0], lambda value: isinstance(value, str) and value in texts)


def numbers(needed: str, example: list[float] | list[int], accepts: Accepts) -> FieldRule:
    """Allow a list of numbers of the length of the example that passes a test."""
    return FieldRule(
        needed,
        example,
        lambda value: (
            isinstance(value, list)
            and len(value) == len(example)
            and all(map(is_number, value))
            and accepts(value)
        ),
    )


def _numbers_in(value: object) -> Iterator[float]:
    """A number, or those of a list, of lists too."""
    if isinstance(value, list):
        for entry in value:
            yield from _numbers_in(entry)
    elif isinstance(value, int | float):
        yield value


def _are_objects(value: object) -> bool:
    return isinstance(value, list) and all(map(_is_object, value))


def _is_object(value: object) -> bool:
    return isinstance(value, dict)


def _label(content: Json) -> str:
    name = content.get("id", content.get("name"))
    return name if isinstance(name, str) else ""


def _without_duplicates(pairs: list[tuple[str, object]]) -> Json:
    content: Json = {}
    for name, value in pairs:
        if name in content:
            raise InputError(
                f'the field "{name}" occurs twice in one object, and either could be meant'
            )
        content[name] = value
    return content


def _shown(value: object) -> str:
    shown = json.dumps(value, ensure_ascii=False)
    return shown if len(shown) <= 80 else f"{shown[:77]}..."


def _written(name: str, example: object) -> str:
    return f'"{name}": {json.dumps(example, ensure_ascii=False)}'


def _fields(names: str) -> dict[str, object]:
    """Fields that hold no objects, by their names with blanks between them."""
    return dict.fromkeys(names.split())


_TRANSDUCER = _fields(
    "id uff_node position_m tolerance_m directions angle_tolerance_rad gain_tolerance "
    "delay_tolerance_s note"
)
_STRUCTURE = {
    **_fields(
        "area_m2 axis boundary_conditions density_kg_m3 height_m length_m motion note "
        "outer_diameter_m poisson_ratio section size_x_m size_y_m thickness_m type wall_m "
        "width_m youngs_modulus_Pa"
    ),
    "damping": _fields("model ratio note"),
    "members": _fields("name start end note"),
    "suspension": _fields("x_m stiffness_N_per_m note"),
}
_PRIOR = _fields("type low high mean standard_deviation median log_standard_deviation")
_MEASUREMENT = {
    **_fields(
        "array baseline_files convention estimator files force_levels_N in_channels n_averages "
        "noise note out_channels quantity sensor_setup units"
    ),
    "noise_level": _fields("coherence_factor floor ratio note"),
    "states": _fields("label files note"),
}
KNOWN: Mapping[str, object] = {
    **_fields("angle_convention angle_prior case nominal_fe_model note position_prior"),
    "actuators": _TRANSDUCER,
    "sensors": _TRANSDUCER,
    "structure": _STRUCTURE,
    "uncertain_parameters": {**_fields("name nominal note"), "prior": _PRIOR},
    "frequency": _fields("band_hz n_lines spacing note"),
    "measurement": _MEASUREMENT,
    "effects": _fields("kind candidate name note pieces law motion direction"),
    "hints": ...,
}
"""Fields of `case.json`, with those of their objects, or of the objects that they list.

`hints` holds anything; a `note` may stand in any object, and says what people should know.
"""


def check_known(fields: JsonObject, known: Mapping[str, object] | None = None) -> None:
    """Refuse a field that is not known: a misspelt one would be ignored."""
    known = KNOWN if known is None else known
    for name, value in fields.content.items():
        if name not in known:
            raise _unknown(fields, name, known)
        below = known[name]
        if isinstance(below, dict):
            for inner in _objects(fields, name, value):
                check_known(inner, below)


def _objects(fields: JsonObject, name: str, value: object) -> list[JsonObject]:
    """Objects in a field; what is none is refused where it is read."""
    if isinstance(value, dict):
        return [fields.object(name)]
    return fields.objects(name) if _are_objects(value) else []


def _unknown(fields: JsonObject, name: str, known: Mapping[str, object]) -> CaseError:
    nearest = difflib.get_close_matches(name, known, n=1, cutoff=0.0)[0]
    return CaseError(
        f"{fields.file}: the field {fields.dotted_path(name)} is not known; the nearest known one "
        f'is "{nearest}". Only known fields are taken, since a misspelt one would be ignored: '
        'correct its name, or put what people should know into "note" or "hints".'
    )
