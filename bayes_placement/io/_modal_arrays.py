"""Modal parameters among the arrays of a file (MATLAB, NumPy, HDF5), by the names of the arrays."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from .._shared.errors import InputError, warn
from ..experiment.modal_parameters import ModalParameters
from ..positions.channel import Channel
from . import _contents as content
from . import arrays
from ._gate import FileWarning
from .arrays.named_arrays import TEXTS
from .mapped._toml_fields import TomlTable, is_text, load
from .uff import modes as measured_modes

_DEVIATION = re.compile(r"_?(deviation|std|sigma|sd)$")
NAMES = {
    "natural_frequency": r"(natural_?)?freq\w*|f_?n|fn_\w*",
    "damping_ratio": r"damp\w*|zeta\w*|xi\w*",
    "shape": r"(mode_?)?shapes?\w*|phi\w*|psi\w*|modes?",
}
"""What the names of arrays look like, in lower case and without the word of a deviation."""

FREQUENCY, DAMPING, SHAPE = NAMES
SENSORS = "sensors"
BESIDE = {"covariance": 3, "correlation": 2, "number": 1}
"""Further arguments of `ModalParameters` that are read under their names, with their axes."""

MOST_NAMES = 5
"""Most arrays that are named where they are not read."""


def holds_modes(path: Path) -> bool:
    """Whether the names of arrays are those of modal parameters."""
    try:
        names = _roles(arrays.load(path).arrays)
    except InputError:
        return False  # whoever reads it says why
    return FREQUENCY in names and (SHAPE in names or DAMPING in names)


def load_arrays(path: Path, names: dict[int, str]) -> measured_modes.Arguments:
    """Read arrays as arguments of `ModalParameters`, without deviations that are not there.

    Shapes are (channel, mode): columns are modes.
    """
    known = arrays.load(path).arrays
    roles = _roles(known)
    if FREQUENCY not in roles:
        raise InputError(
            f"it holds {', '.join(known) or 'no array'}, none of which is named as natural "
            "frequencies are; arrays natural_frequency [Hz], damping_ratio [1] and shape (channel, "
            "mode) are needed, since names say what they are. Save them under these."
        )
    values = {role: np.squeeze(known[name]) for role, name in roles.items()}
    shape = values.get(SHAPE)
    frequency = np.atleast_1d(values[FREQUENCY])
    if shape is not None and shape.ndim < 2:  # of one mode, or of one channel
        shape = np.reshape(shape, (-1, frequency.size))
    _check_sizes(roles, frequency.size, {**values, SHAPE: shape})
    order = np.argsort(frequency)
    names_wanted = (role + suffix for role in NAMES for suffix in ("", "_deviation"))
    arguments: measured_modes.Arguments = {
        name: np.atleast_1d(values[name])[..., order] if name in values else None
        for name in names_wanted
    }
    count = 0 if shape is None else len(shape)
    arguments[SHAPE] = shape[:, order] if shape is not None and count else None
    named = {name.rpartition(".")[2].lower(): name for name in known}
    labels = _labels(known.get(named.get(SENSORS, "")), count)
    beside = {name: known[named[name]] for name in BESIDE if name in named}
    read = {*roles.values(), *(named.get(name) for name in (*BESIDE, SENSORS))}
    _tell_unread(path, [name for name in known if name not in read])
    return {
        **arguments,
        **{name: _beside(name, array, order) for name, array in beside.items() if array.size},
        SENSORS: tuple(Channel.parse(names.get(row, label)) for row, label in labels.items()),
    }


def _beside(name: str, array: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Array of a further argument in the order of frequency; of another size to be refused."""
    lacking = range(BESIDE[name] - array.ndim)  # MATLAB files do not keep the axis of one mode
    whole = np.expand_dims(array, tuple(lacking))
    axes = 2 if name == "correlation" else 1
    if whole.shape[:axes] != (len(order),) * axes:
        return whole
    return whole[np.ix_(*[order] * axes)]


def _labels(stated: np.ndarray | None, count: int) -> dict[int, str]:
    """Labels of the rows of shapes by number, which are numbers where the file names none."""
    if stated is None or stated.dtype.kind not in TEXTS or not count:
        stated = np.arange(1, count + 1)
    return {row: str(label) for row, label in enumerate(stated.ravel(), start=1)}


def _tell_unread(path: Path, names: Sequence[str]) -> None:
    if names:
        further = ", ..." if len(names) > MOST_NAMES else ""
        warn(
            f"{path}: not read: {', '.join(names[:MOST_NAMES])}{further}, since no modal "
            "parameters have such names: bp.io.modal_parameters.read lists those that are read.",
            FileWarning,
        )


def arrays_of(modes: ModalParameters) -> dict[str, Any]:
    """Return arrays that hold all of modal parameters."""
    number = () if modes.number is None else modes.number
    return {
        FREQUENCY: modes.natural_frequency,
        DAMPING: modes.damping_ratio,
        SHAPE: modes.shape,
        "covariance": modes.covariance,
        "correlation": modes.correlation,
        SENSORS: np.array([channel.label for channel in modes.sensors], dtype=str),
        "number": np.array(number, dtype=int),
    }


def _roles(known: dict[str, np.ndarray]) -> dict[str, str]:
    """Names of arrays by what they are; refuses two of one kind."""
    found: dict[str, str] = {}
    for name, values in known.items():
        plain = name.rpartition(".")[2].lower()
        base = _DEVIATION.sub("", plain)
        kind = next((role for role, rule in NAMES.items() if re.fullmatch(rule, base)), None)
        if kind is None or values.dtype.kind not in "iufc":
            continue
        role = kind + ("_deviation" if base != plain else "")
        if role in found:
            raise InputError(
                f"it holds {found[role]} and {name}, and either could be the {role}; one is "
                "needed. Save it without the other."
            )
        found[role] = name
    return found


def _check_sizes(roles: dict[str, str], modes: int, values: dict[str, Any]) -> None:
    for role, name in roles.items():
        size = np.shape(values[role])[-1:] or (1,)
        if size != (modes,):
            raise InputError(
                f"{name} has the shape {np.shape(values[role])}, and there are {modes} natural "
                f"frequencies; {modes} columns are needed, one a mode, since shapes are (channel, "
                "mode). Save it transposed."
            )


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
        return holds_modes(path)
    return kind == content.TEXT and HEADING in content.head_of(path).lower().replace(" ", "_")


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
    stated: dict[str, str] = table.value("names", _are_names, "a table of names", _EXAMPLE) or {}
    return {int(node): name for node, name in stated.items()}


_EXAMPLE = 'names = { 11 = "s1", 12 = "s2" }'


def _are_names(value: object) -> bool:
    """Whether a value says names by numbers of nodes."""
    return isinstance(value, dict) and all(
        node.isdecimal() and is_text(name) for node, name in value.items()
    )
