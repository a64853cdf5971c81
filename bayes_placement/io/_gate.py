"""What every reader does first: look at the file, limit it, turn errors of libraries into ours."""

import math
import os
import re
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TypeAlias, TypeGuard

import numpy as np
from jaxtyping import Bool, Complex, Float

from .._shared.arguments import check_kind
from .._shared.errors import InputError, MissingExtraError, UsageError, warn
from ._child import in_words
from ._contents import WIDE, is_wide

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

Accepts: TypeAlias = Callable[[Any], bool]
"""Whether a field is what is needed."""


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


class FileWarning(UserWarning):
    """What a file does not say, or what of it was left out."""


class UnreadableError(Exception):
    """Why a file cannot be read, of which `reading` makes a sentence."""


LARGEST = 1e30
"""Greatest number that is read: no quantity in SI is as large, and its square must be finite."""

_FILES_READ: ContextVar[list[Path] | None] = ContextVar("_FILES_READ", default=None)


@contextmanager
def files_read() -> Iterator[list[Path]]:
    """Collect the files that readers open meanwhile, each once, in the order of their reading."""
    files: list[Path] = []
    token = _FILES_READ.set(files)
    try:
        yield files
    finally:
        _FILES_READ.reset(token)


@contextmanager
def reading(path: Path, contents: str, remedy: str, *, is_timed: bool = True) -> Iterator[None]:
    """Turn what goes wrong while a file is read into an error that names the file.

    `contents` is what it is read as, such as `a universal file`, and `remedy` a sentence. Errors of
    this package keep their type, and so do its warnings that a caller makes errors. Modes of a
    structure may take long: they are not timed.
    """
    try:
        with time_limit(path) if is_timed else nullcontext():
            yield
        files = _FILES_READ.get()
        if files is not None and path not in files:
            files.append(path)
    except (MissingExtraError, FileWarning):
        raise
    except InputError as error:
        words = str(error)
        if len(words) > 2000:  # as of a long cell, or a list
            words = f"{words[:1000]} ... {words[-500:]}"
        elif path.name in words:
            raise
        raise type(error)(words if path.name in words else f"{path}: {words}") from error
    except OSError as error:
        if error.filename is not None or isinstance(error, FileNotFoundError):
            raise
        raise _unreadable(path, contents, remedy, error) from error
    except (Exception, TimeIsUpError) as error:  # libraries raise any for a damaged file
        raise _unreadable(path, contents, remedy, error) from error


def path_of(path: object) -> Path:
    """Return a path, and refuse all else."""
    needed = "the path of a file or folder is needed, since it is read from there"
    check_kind("path", path, (str, Path), needed, 'path="measured.uff"')
    if "\0" in str(path):
        raise InputError(f"path={str(path)!r} was given; {needed}: path='measured.uff'.")
    return Path(str(path))


def existing(path: Path, contents: str) -> Path:
    """Return the path of a file that is there, and no larger than what is read into memory."""
    if path.is_dir():
        raise FileNotFoundError(
            f"{path} is a folder; {contents} is needed, since one file is read. Name the one in "
            f"it: {path / 'measured.uff'}."
        )
    if not path.is_file():
        raise FileNotFoundError(
            f"There is no file {path}; {contents} is needed. Check the folder: Path(...).resolve()."
        )
    try:
        check_limit("bytes", path.stat().st_size)
    except InputError as error:
        raise type(error)(f"{path}: {error}") from error
    return path


def check_plausible(path: Path, /, **arrays: object) -> None:
    """Refuse numbers that are not finite, or larger than any quantity in SI."""
    for name, values in arrays.items():
        array = np.asarray(values)
        if array.dtype.kind not in "fc" or not array.size or _within(array):
            continue
        wrong = array[~(np.abs(array) <= LARGEST)]
        raise InputError(
            f"{path} holds {wrong.flat[0]:g} as {name}; finite numbers up to {LARGEST:g} are "
            "needed, since no quantity in SI is larger. The file is damaged or in another unit: "
            "export it again."
        )


def _within(array: np.ndarray) -> bool:
    """Whether all numbers are in range, without a copy of them; NaN is not."""
    parts = (array.real, array.imag) if array.dtype.kind == "c" else (array,)
    with np.errstate(invalid="ignore"):
        return all(float(part.max()) <= LARGEST and float(part.min()) >= -LARGEST for part in parts)


def _unreadable(path: Path, contents: str, remedy: str, error: BaseException) -> InputError:
    reason = " ".join(in_words(error).split())[:300]
    return InputError(
        f"{path} cannot be read as {contents} ({reason}); a complete file is needed. {remedy}"
    )


def text_in_utf8(path: Path) -> str:
    """Text of a small file, without numbers of more digits than Python reads."""
    content = path.read_bytes()
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = None
    if text is None or is_wide(content):
        raise InputError(
            f"it is {WIDE if is_wide(content) else 'text in another encoding'}; UTF-8 is needed, "
            "since letters would be others"
        )
    number = re.search(r"[\d_]{1000}", text)
    if number:
        raise InputError(
            f"it holds the number {number[0][:20]}... of 1000 digits or more; numbers up to "
            f"{LARGEST:g} are needed, since no quantity in SI is larger"
        )
    return text


def is_number(value: object) -> TypeGuard[float]:
    """Whether a value of a file of JSON or TOML is a finite number, as large as a float may be."""
    try:
        return isinstance(value, int | float) and type(value) is not bool and math.isfinite(value)
    except OverflowError:
        return False


MOST = 0.5
"""Share of such lines from which on the file as a whole is refused."""


def usable_lines(
    path: Path,
    frequency: Float[np.ndarray, "frequency"],
    frf: Complex[np.ndarray, "sensor actuator frequency"],
    coherence: Float[np.ndarray, "sensor actuator frequency"] | None,
) -> Bool[np.ndarray, "frequency"]:
    """Tell which lines are read, and warn of the others.

    FRFs are NaN for pairs that were not measured, their coherence where it is unknown.
    """
    measured = ~np.isnan(frf).all(axis=-1, keepdims=True)
    wrong = measured & ~np.isfinite(frf)
    if coherence is not None:
        known = measured & ~np.isnan(coherence).all(axis=-1, keepdims=True)
        wrong |= known & ~((coherence >= 0) & (coherence <= 1))
    lines = wrong.any(axis=(0, 1))
    if not lines.any() or lines.mean() >= MOST:
        return np.ones(lines.shape, dtype=bool)  # what is wrong everywhere is refused
    shown = ", ".join(f"{value:g}" for value in frequency[lines][:5])
    warn(
        f"{path}: {lines.sum()} of {lines.size} lines were left out ({shown}"
        f"{', ...' if lines.sum() > 5 else ''} Hz), since a coherence outside of 0 to 1, or an FRF "
        "that is not finite, is no measurement. Look for overloads or too few averages there.",
        FileWarning,
    )
    return ~lines
