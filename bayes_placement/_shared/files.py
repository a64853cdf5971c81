"""Files that are complete or not there at all."""

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from .errors import WritingError

if TYPE_CHECKING:
    import pandas as pd

try:
    import fcntl
except ImportError:  # Windows: files cannot be locked so, and leftovers stay
    fcntl = None  # type: ignore[assignment]

Cell = TypeVar("Cell")
Json: TypeAlias = dict[str, Any]
"""An object of JSON by the names of its fields."""

UNFINISHED = ".unfinished-"
"""Part of the names of files that are still being written, or were when their process ended."""


def write_atomically(path: str | Path, write: Callable[[Path], object]) -> Path:
    """Write a temporary file in the same folder and rename it once it is on the disk.

    Temporary files of processes that were killed are deleted. Its folder is made. The temporary
    file has the same suffix.

    A `WritingError` says that the disk is full, or the folder read-only.
    """
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        delete_leftovers(target.parent)
        with _temporary(target) as temporary:
            write(temporary)
            _to_disk(temporary)
            temporary.replace(target)
        with suppress(OSError):  # not all systems flush folders
            _to_disk(target.parent)
    except OSError as error:
        raise WritingError(
            f"{target} could not be written ({error.strerror or error}); a folder that can be "
            "written to, with room, is needed. Files that were written before are complete, and an "
            "earlier file of this name is as it was. Make room or give another folder, and run "
            "again."
        ) from error
    return target


def delete_leftovers(folder: Path) -> None:
    """Delete temporary files that a process left in a folder when it was killed.

    Those that are just being written are locked, and stay.
    """
    for path in folder.glob(f".*{UNFINISHED}*"):
        # It is being written, was deleted meanwhile, or is in a read-only folder.
        with suppress(OSError), _locked(path):
            path.unlink()


def lock(handle: int) -> None:
    """Lock an open file until it is closed, be it by the end of the process."""
    if fcntl is None:
        raise OSError("this system cannot lock files")
    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    handle = os.open(path, os.O_RDWR)
    try:
        lock(handle)
        yield
    finally:
        os.close(handle)


@contextmanager
def _temporary(target: Path) -> Iterator[Path]:
    """A temporary file next to a file, locked meanwhile and deleted if it is still there after."""
    handle, path = _new_file(target)
    while not _is_locked(handle):
        os.close(handle)
        handle, path = _new_file(target)
    if fcntl is None:  # Windows renames no open file
        os.close(handle)
    try:
        yield path
    finally:
        path.unlink(missing_ok=True)
        if fcntl is not None:
            os.close(handle)


def _new_file(target: Path) -> tuple[int, Path]:
    """A new file, with the permissions that the user gives to files."""
    path = target.with_name(f".{target.stem}{UNFINISHED}{token_hex(4)}{target.suffix}")
    return os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666), path


def _is_locked(handle: int) -> bool:
    """Lock a new file, unless another process took it for left over and deletes it."""
    try:
        lock(handle)
    except BlockingIOError:
        return False
    except OSError:  # where files cannot be locked none is deleted
        return True
    return os.fstat(handle).st_nlink > 0


def _to_disk(path: Path) -> None:
    """Wait until a file or a folder has reached the disk: a rename may reach it earlier."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_json(path: str | Path, content: object) -> Path:
    """Write numbers and words as JSON, atomically."""
    text = json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False)
    return write_atomically(
        path, lambda temporary: temporary.write_text(f"{text}\n", encoding="utf-8")
    )


def write_csv(path: str | Path, table: "pd.DataFrame", *, index: bool) -> None:
    """Write a table as CSV in which no text is a formula for spreadsheets, see `no_formula`."""
    safe = table.map(no_formula).rename(index=no_formula, columns=no_formula)
    Path(path).write_text(safe.to_csv(index=index), encoding="utf-8", newline="")


def no_formula(cell: Cell) -> Cell | str:
    """Return a cell of a table; what begins as a formula and is no number begins with a '."""
    if not isinstance(cell, str) or not cell.startswith(("=", "+", "-", "@")):
        return cell
    try:
        float(cell)
    except ValueError:
        return f"'{cell}"
    return cell
