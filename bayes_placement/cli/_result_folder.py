"""The folder of the results: looked at before anything is computed, and of one run at a time."""

import os
import platform
import shlex
import shutil
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

import typer

from .._files import UNFINISHED, delete_leftovers, lock
from .._types import InputError
from ._errors import STOPPED

RUNNING = ".running"
"""File that says in a line which run writes into a folder, and is locked by it."""

LEAST_ROOM = 32 << 20
"""Bytes that must be free on the disk of the results."""

SHOWN = 4
"""Files that are named after Ctrl-C, at most."""


@contextmanager
def result_folder(out: Path) -> Iterator[None]:
    """Make the folder of the results and keep other runs out of it; say what is kept after Ctrl-C.

    Temporary files that a killed run left are deleted. A folder in which nothing was written is
    deleted again.

    Parameters
    ----------
    out
        The folder.

    Raises
    ------
    InputError
        If it cannot be written to, its disk is full, or another run writes into it.
    """
    new = _made(out)
    try:
        with _claimed(out):
            for folder in (out, *(path for path in out.iterdir() if path.is_dir())):
                delete_leftovers(folder)
            before = _versions(out)
            try:
                yield
            except KeyboardInterrupt:
                typer.secho(_words_on_kept(out, before), err=True)
                raise typer.Exit(STOPPED) from None
    finally:
        for folder in new:
            with suppress(OSError):  # it holds something
                folder.rmdir()


def _made(out: Path) -> list[Path]:
    """Make a folder, and return those that were made for it, the innermost first."""
    if out.exists() and not out.is_dir():
        raise InputError(
            f"--out {out} is a file. A folder is needed, which is made if it is not there: "
            "--out results."
        )
    new = [folder for folder in (out, *out.parents) if not folder.exists()]
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _not_writable(out, error) from error
    return new


@contextmanager
def _claimed(out: Path) -> Iterator[None]:
    """Lock a folder by a file in it, whose line says for which run."""
    path = out / RUNNING
    handle = _locked(path, out)
    try:
        earlier = os.read(handle, 1000).decode(errors="replace").strip()
        _check_room(out)
        _write_line(handle, out)
        if earlier:
            words = f"An earlier run into {out} did not end ({earlier}). What it wrote is complete."
            typer.echo(words, err=True)
        yield
    finally:
        path.unlink(missing_ok=True)  # while it is still locked
        os.close(handle)


def _locked(path: Path, out: Path) -> int:
    """Descriptor of the file that locks a folder."""
    while True:
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise _not_writable(out, error) from error
        try:
            lock(handle)
        except BlockingIOError as error:
            os.close(handle)
            raise _in_use(out, path) from error
        except OSError:  # a system without locks: everybody may write
            return handle
        if _is_still(handle, path):
            return handle
        os.close(handle)  # the run before this one has just ended


def _is_still(handle: int, path: Path) -> bool:
    """Whether a path still leads to an open file."""
    try:
        return os.path.samestat(os.fstat(handle), path.stat())
    except FileNotFoundError:
        return False


def _in_use(out: Path, path: Path) -> InputError:
    try:
        whose = f" ({path.read_text(encoding='utf-8', errors='replace').strip()})"
    except OSError:  # it has just ended
        whose = ""
    return InputError(
        f"--out {out} is in use by another run{whose}; one run at a time is needed, since both "
        f"would write the same files. Wait until it ends, or give another folder: --out {out}-2."
    )


def _check_room(out: Path) -> None:
    usage = shutil.disk_usage(out)
    if usage.total and usage.free < LEAST_ROOM:
        raise InputError(
            f"--out {out} is on a disk with {usage.free / 1e6:.1f} MB left; "
            f"{LEAST_ROOM / 1e6:.0f} MB are needed before anything is computed, since results and "
            "figures are written there. Make room, or give a folder on another disk."
        )


def _write_line(handle: int, out: Path) -> None:
    """Say in the file which run it is; fails where the disk is read-only or full."""
    command = shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])
    now = datetime.now().strftime("%Y-%m-%d %H:%M:%S")
    line = f"process {os.getpid()} on {platform.node()} since {now}: {command}\n"
    try:
        os.lseek(handle, 0, os.SEEK_SET)
        os.truncate(handle, 0)
        os.write(handle, line.encode())
        os.fsync(handle)
    except OSError as error:
        raise _not_writable(out, error) from error


def _not_writable(out: Path, error: OSError) -> InputError:
    return InputError(
        f"--out {out} cannot be written to ({error.strerror}); a folder that can be is needed "
        "before anything is computed, since results are written there: --out ~/results."
    )


def _versions(out: Path) -> dict[Path, tuple[int, int]]:
    """Files below a folder, each with what changes when it is written anew."""
    files = (path for path in out.rglob("*") if path.is_file() and path.name != RUNNING)
    stats = {path: path.stat() for path in files if UNFINISHED not in path.name}
    return {path: (stat.st_ino, stat.st_mtime_ns) for path, stat in stats.items()}


def _words_on_kept(out: Path, before: dict[Path, tuple[int, int]]) -> str:
    """Sentence on the files that a run wrote until it was stopped."""
    after = _versions(out)
    written = sorted(path for path, version in after.items() if before.get(path) != version)
    if not written:
        return f"Stopped. Nothing of this run is in {out} yet."
    names = [path.name for path in written if path.parent == out]
    folders = Counter(path.parent.relative_to(out) for path in written if path.parent != out)
    more = [f"{len(names) - SHOWN} more"] if len(names) > SHOWN else []
    parts = [*names[:SHOWN], *more, *(f"{count} in {folder}/" for folder, count in folders.items())]
    return f"Stopped. What was finished is complete and stays in {out}: {', '.join(parts)}."
