"""How much is read of a file of each format, and how more is allowed."""

import os

from .._types import InputError, UsageError

VARIABLE = "BAYES_PLACEMENT_LARGER_FILES"
"""Variable of the environment: how many times as much is read."""

LIMITS = {
    "bytes": 8 << 30,
    "bytes of text": 512 << 20,
    "cells of text": 5_000_000,
    "unpacked bytes of a NumPy archive": 1 << 30,
    "unpacked bytes of a workbook": 128 << 20,
    "rows of a workbook": 200_000,
    "cells of a workbook": 1_000_000,
    "unpacked bytes of an HDF5 file": 1 << 30,
    "unpacked bytes of a MATLAB file": 1 << 30,
    "elements of a MATLAB file": 200_000,
}
"""Most that is read, in a minute at most; measured FRFs are smaller by factors of ten."""


def most(what: str) -> int:
    """Most of something that is read."""
    stated = os.environ.get(VARIABLE, "1")
    if not stated.isdecimal() or not 1 <= int(stated) <= 1000:
        raise UsageError(
            f"{VARIABLE}={stated} stands in the environment; a whole number from 1 to 1000 is "
            f"needed, since it says how many times as much is read: {VARIABLE}=4"
        )
    return int(stated) * LIMITS[what]


def check_limit(what: str, count: int) -> None:
    """Refuse more than is read of a file.

    Parameters
    ----------
    what
        One of `LIMITS`.
    count
        How many there are, or at least.
    """
    if count > most(what):
        raise InputError(
            f"it has {count} {what} or more; at most {most(what)} are read, since a small file may "
            f"ask for all memory. Export fewer lines or channels, or set {VARIABLE}=4 to read four "
            "times as much"
        )
