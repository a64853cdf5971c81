"""Named arrays of a file, whose meaning is not known yet."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._shared.reprs import with_short_repr

NUMBERS, TEXTS = "biufc", "U"


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
