"""Notes that `write` records in ID lines of functions: names, averages and force level."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np

from ._datasets import Dataset, MeasurementFileError


def note_of(dataset: Dataset, line: str) -> dict[str, Any]:
    """Return the note that `write` recorded in an ID line as JSON; empty for any other text."""
    text = dataset.fields[line].strip()
    try:
        note = json.loads(text) if text.startswith("{") else {}
    except (json.JSONDecodeError, RecursionError):
        return {}  # other programs write any text there
    _check_note(dataset, line, note)
    return note


def _check_note(dataset: Dataset, line: str, note: dict[str, Any]) -> None:
    """Refuse a note that `write` does not make: a changed one names the wrong channels."""
    for name, value in note.items():
        if name in _NOTES and not _NOTES[name](value):
            raise MeasurementFileError(
                f"{dataset.place} records {name}={value!r} in {line.upper()}; the note that "
                "io.uff.write makes has two names, a whole number of averages and a force above 0, "
                "since it says what the format has no field for. Correct it or clear that line."
            )


def _are_names(value: Any) -> bool:
    is_pair = isinstance(value, list) and len(value) == 2
    return is_pair and all(isinstance(name, str) and name.strip() for name in value)


def _is_force(value: Any) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return value is None or (is_number and 0 < value < np.inf)


_NOTES: dict[str, Callable[[Any], bool]] = {
    "names": _are_names,
    "averages": lambda value: value is None or (type(value) is int and value >= 1),
    "force_level": _is_force,
}
