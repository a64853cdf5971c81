"""Which files hold modal parameters, and the mapping (TOML) that says what such a file does not."""

from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

from .._shared.errors import InputError
from . import _contents as content
from . import _modal_arrays
from .mapped._toml_fields import TomlTable, is_text, load
from .uff import measured_modes

TABLE, SUFFIX = "modal_parameters", ".toml"
"""Table of a mapping that is about modal parameters, and the suffix of a mapping."""

HEADING = "natural_frequency"
"""Beginning of the name of a column that every table of modal parameters has."""

DEVIATIONS = ("frequency_deviation", "damping_deviation", "shape_deviation")
OF_ARRAYS = (content.MAT, content.MAT_HDF5, content.HDF5, content.NPZ)
"""Files that may hold modal parameters as arrays by name."""

PoleUnit = Literal["rad/s", "Hz"]
"""Unit of the poles of complex modes."""

_KNOWN = ("file", *DEVIATIONS, "names", "poles")


class ModalMapping(NamedTuple):
    """What a mapping says of modal parameters: the file, deviations, names, unit of poles."""

    file: Path
    deviations: dict[str, float]
    names: dict[int, str]
    poles: PoleUnit | None


def holds_modal_parameters(path: Path) -> bool:
    """Whether a file holds modal parameters and no FRFs, or is a mapping of such a file."""
    if is_mapping(path):
        return TABLE in load(path).content
    if not path.is_file():
        return False  # whoever reads it says so
    kind = content.content_of(path)
    if kind == content.UNIVERSAL:
        return measured_modes.holds_modes_alone(path)
    if kind in OF_ARRAYS:
        return _modal_arrays.holds_modes(path)
    return kind == content.TEXT and HEADING in content.head_of(path)


def is_mapping(path: Path) -> bool:
    """Whether a file is a mapping, by its suffix."""
    return path.suffix.lower() == SUFFIX


def read_mapping(path: Path) -> ModalMapping:
    """Read the mapping of a file of modal parameters."""
    table = load(path).table(TABLE)
    if table is None:
        raise InputError(
            f"{path} has no table [{TABLE}]; one is needed, since it says of which file it is and "
            f'how far values may be off: [{TABLE}] with file = "modes.uff" and '
            "frequency_deviation = 0.001."
        )
    table.check_known(_KNOWN)
    file = table.text("file", "modes.uff")
    if file is None:
        raise table.error("file", "the name of the file of modes", 'file = "modes.uff"')
    deviations = {word: table.number(word, "0.01", 0.0) for word in DEVIATIONS}
    return ModalMapping(
        path.parent / file,
        {word: value for word, value in deviations.items() if value is not None},
        _names(table),
        table.value("poles", get_args(PoleUnit).__contains__, "rad/s or Hz", 'poles = "Hz"'),
    )


def _names(table: TomlTable) -> dict[int, str]:
    stated: dict[str, Any] = table.value("names", _are_names, "a table of names", _EXAMPLE) or {}
    return {int(node): name for node, name in stated.items()}


_EXAMPLE = 'names = { 11 = "s1", 12 = "s2" }'


def _are_names(value: Any) -> bool:
    """Whether a value says names by numbers of nodes."""
    return isinstance(value, dict) and all(
        node.isdecimal() and is_text(name) for node, name in value.items()
    )
