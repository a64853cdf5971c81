"""Named arrays of a file, whose meaning is not known yet."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._shared.errors import InputError
from ..._shared.reprs import with_short_repr

NUMBERS, TEXTS = "biufc", "U"
_DEEPEST = 30


@with_short_repr
class NamedArrays(NamedTuple):
    """What a file of arrays holds.

    Parameters
    ----------
    path
        The file.
    format
        What kind of file it is, in words.
    arrays
        Numbers and texts by name; a field of a structure is `structure.field`.
    units
        Units that the file states with an array, as it writes them.
    left_out
        What was not read, by name, and why.

    Examples
    --------
    >>> from pathlib import Path
    >>> np.savez("measured.npz", frequency=experiment.frequency)
    >>> arrays = bp.io.arrays.load(Path("measured.npz"))
    >>> arrays.format, list(arrays.arrays)
    ('a NumPy archive', ['frequency'])
    """

    path: Path
    format: str
    arrays: dict[str, np.ndarray]
    units: dict[str, str]
    left_out: dict[str, str]


def flattened(path: Path, form: str, content: Mapping[str, object]) -> NamedArrays:
    """Make named arrays of nested dictionaries, as readers of MATLAB files return them."""
    arrays: dict[str, np.ndarray] = {}
    left_out: dict[str, str] = {}
    _add(content, "", arrays, left_out)
    return NamedArrays(path, form, arrays, {}, left_out)


def _add(
    content: Mapping[str, object],
    prefix: str,
    arrays: dict[str, np.ndarray],
    left_out: dict[str, str],
) -> None:
    if prefix.count(".") > _DEEPEST:
        raise InputError(f"structures are nested more than {_DEEPEST} deep at {prefix!r}")
    for key, value in content.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            _add(value, f"{name}.", arrays, left_out)
        elif isinstance(value, list | tuple) and any(isinstance(item, Mapping) for item in value):
            numbered = {str(number): item for number, item in enumerate(value, start=1)}
            _add(numbered, f"{name}.", arrays, left_out)
        else:
            _add_array(name, value, arrays, left_out)


def _add_array(
    name: str, value: object, arrays: dict[str, np.ndarray], left_out: dict[str, str]
) -> None:
    array = _array(value)
    if array.dtype.kind not in NUMBERS + TEXTS:
        left_out[name] = "it holds neither numbers nor text"
    elif not array.size:
        left_out[name] = "it is empty"
    else:
        arrays[name] = array


def _array(value: object) -> np.ndarray:
    """Array of a value; of objects where it is none, as where a list mixes numbers and texts."""
    try:
        array = np.asarray(value)
    except ValueError:
        return np.array(None)
    if isinstance(value, list | tuple) and array.dtype.kind == "U":
        return array if all(isinstance(item, str) for item in value) else np.array(None)
    return array
