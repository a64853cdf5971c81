"""How much is read of a file of each format, and how more is allowed."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .._shared.errors import InputError, UsageError

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


SECONDS, SECONDS_PER_MEGABYTE = 8.0, 2.0
"""Time of the processor that a file may take, which other work on the machine does not prolong."""


class TimeIsUpError(BaseException):
    """A file takes too long; no library takes it for a number that cannot be read."""


def seconds(path: Path) -> float:
    """Time of the processor that reading a file may take."""
    size = path.stat().st_size if path.is_file() else 0
    return _times() * (SECONDS + SECONDS_PER_MEGABYTE * size / 1e6)


@contextmanager
def time_limit(path: Path) -> Iterator[None]:
    """Stop what reads a file for too long; files that it reads meanwhile have times of their own.

    Only the main thread of a system with timers of the processor can be stopped.
    """
    timer = getattr(signal, "setitimer", None)
    if timer is None or threading.current_thread() is not threading.main_thread():
        yield
        return
    allowed = seconds(path)

    def stop(*_: object) -> None:
        raise TimeIsUpError(
            f"it did not end within {allowed:.3g} s of computing, of which {VARIABLE}=4 allows "
            "four times as much"
        )

    before = signal.signal(signal.SIGVTALRM, stop)
    left = timer(signal.ITIMER_VIRTUAL, allowed, 1.0)  # again, where a destructor swallows it
    try:
        yield
    finally:
        timer(signal.ITIMER_VIRTUAL, *left)
        signal.signal(signal.SIGVTALRM, before)


def most(what: str) -> int:
    """Most of something that is read."""
    return _times() * LIMITS[what]


def _times() -> int:
    stated = os.environ.get(VARIABLE, "1")
    if not stated.isdecimal() or not 1 <= int(stated) <= 1000:
        raise UsageError(
            f"{VARIABLE}={stated} stands in the environment; a whole number from 1 to 1000 is "
            f"needed, since it says how many times as much is read: {VARIABLE}=4"
        )
    return int(stated)


def check_limit(what: str, count: int) -> None:
    """Refuse more than is read of a file: one of `LIMITS`, of which there are at least so many."""
    if count > most(what):
        raise InputError(
            f"it has {count} {what} or more; at most {most(what)} are read, since a small file may "
            f"ask for all memory. Export fewer lines or channels, or set {VARIABLE}=4 to read four "
            "times as much"
        )
