"""Files of earlier and later states that a case names."""

from pathlib import Path
from typing import Any

from ...positions.names import LONGEST, is_printable
from ._json_fields import CaseError, FieldRule, JsonObject, check_distinct


def baseline_files(stated: JsonObject) -> tuple[str, ...]:
    """Return the universal files among those of the baseline; others hold the same."""
    return _files(stated, "baseline_files") if stated.has("baseline_files") else ()


def state_files(stated: JsonObject) -> dict[str, tuple[str, ...]]:
    """Return the universal files of each state by its label, in their order, the baseline first."""
    if not stated.has("states"):
        return {}
    states = stated.objects("states", least=2)
    labels = [state.value("label", _LABEL) for state in states]
    check_distinct("label", states)
    if stated.has("baseline_files"):
        raise CaseError(
            f"{stated.file} has {stated.dotted_path('baseline_files')} and "
            f"{stated.dotted_path('states')}; one of them is needed, since the first of several "
            "states is the baseline. Leave measurement.baseline_files out."
        )
    return {label: _files(state, "files") for label, state in zip(labels, states, strict=True)}


def _files(stated: JsonObject, field: str) -> tuple[str, ...]:
    return tuple(name for name in stated.value(field, _FILES) if name.endswith(".uff"))


def _are_file_names(value: Any) -> bool:
    """Names of files in the folder of the case, none of which leads out of it."""
    return isinstance(value, list) and all(
        isinstance(name, str) and name == Path(name).name and name not in ("", ".", "..")
        for name in value
    )


_FILES = FieldRule(
    "a list of names of files in the folder of the case", ["baseline.uff"], _are_file_names
)


_LABEL = FieldRule(
    f"a text of at most {LONGEST} letters that can be printed",
    "5 mm cut",
    lambda value: isinstance(value, str) and is_printable(value),
)
