"""Files of an earlier state that a case names."""

from pathlib import Path
from typing import Any

from ._json_fields import FieldRule, JsonObject


def baseline_files(stated: JsonObject) -> tuple[str, ...]:
    """Return the universal files among those of the baseline; others hold the same."""
    names = stated.value("baseline_files", _FILES) if stated.has("baseline_files") else []
    return tuple(name for name in names if name.endswith(".uff"))


def _are_file_names(value: Any) -> bool:
    """Names of files in the folder of the case, none of which leads out of it."""
    return isinstance(value, list) and all(
        isinstance(name, str) and name == Path(name).name and name not in ("", ".", "..")
        for name in value
    )


_FILES = FieldRule(
    "a list of names of files in the folder of the case", ["baseline.uff"], _are_file_names
)
