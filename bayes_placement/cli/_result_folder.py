"""The folder of the results: looked at before anything is computed, and of one run at a time."""

import hashlib
import json
import os
import platform
import shlex
import shutil
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import typer

from .._shared.errors import UsageError
from .._shared.files import UNFINISHED, Json, delete_leftovers, lock
from ._streams import printable

RESULTS = Path("results")
"""Folder of the results of all models."""

RECORD = "run.json"
"""File with what the runs in a folder were given and what they have written, by command."""

RUNNING = ".running"
"""File that says in a line which run writes into a folder, and is locked by it."""

LEAST_ROOM = 32 << 20
"""Bytes that must be free on the disk of the results."""

SHOWN = 4
"""Files that are named after Ctrl-C, at most."""


class ResultFolder(NamedTuple):
    """The folder of the results of a run, and that of what the runs of one model share."""

    path: Path
    shared: Path


@contextmanager
def result_folder(model: Path, command: str, out: Path | None) -> Iterator[ResultFolder]:
    """Make the folder of the results and keep other runs out of it; say what is kept after Ctrl-C.

    Temporary files that a killed run left are deleted. A folder in which nothing was written is
    deleted again.

    Where the user names none, it is `results/MODEL/COMMAND-1` and so on; MODEL is the name of the
    file, after that of its folder where another file has the same.
    """
    home = _home(model)
    new = _made_new(home, command) if out is None else _made(out)
    folder = ResultFolder(new[0], home) if out is None else ResultFolder(out, out)
    with _of_one_run(folder, new):
        _check_model(folder.path, model)
        yield folder


def _home(model: Path) -> Path:
    """Folder of a model: its name, after those of folders above it where another has its name."""
    parts = model.resolve().with_suffix("").parts[1:]
    names = ("_".join(parts[-count:]) for count in range(1, len(parts) + 1))
    homes = [RESULTS.absolute() / name for name in names]
    return next((home for home in homes if not _is_of_another(home, model)), homes[-1])


def _is_of_another(home: Path, model: Path) -> bool:
    """Whether a folder has results of another model file, which is still where it was."""
    runs = (records(file.parent).values() for file in home.glob(f"*/{RECORD}"))
    paths = {record["model"]["path"] for each in runs for record in each}
    return any(Path(path).exists() for path in paths - {source_of(model)["path"]})


@contextmanager
def _of_one_run(results: ResultFolder, new: list[Path]) -> Iterator[None]:
    """Keep other runs out of a folder; delete in the end what is empty of those made for it."""
    out = results.path
    try:
        with _claimed(out):
            for folder in (out, *(path for path in out.iterdir() if path.is_dir())):
                delete_leftovers(folder)
            before = _versions(results.shared)
            try:
                yield
            except KeyboardInterrupt as error:
                error.add_note(_words_on_kept(results, before))
                raise
    finally:
        for folder in new:
            with suppress(OSError):  # it holds something
                folder.rmdir()


def _made(out: Path) -> list[Path]:
    """Make a folder, and return those that were made for it, the innermost first."""
    if out.exists() and not out.is_dir():
        raise UsageError(
            f"--out {out} is a file. A folder is needed, which is made if it is not there: "
            "--out results."
        )
    new = [folder for folder in (out, *out.parents) if not folder.exists()]
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _not_writable(out, error) from error
    return new


def _made_new(home: Path, command: str) -> list[Path]:
    """Make a folder that was not there, and return it and those that were made for it."""
    new = [folder for folder in (home, *home.parents) if not folder.exists()]
    number = 1
    while True:
        folder = home / f"{command}-{number}"
        try:
            folder.mkdir(parents=True)
        except FileExistsError:  # of an earlier run, or of one that begins at this moment
            number += 1
        except OSError as error:
            raise _not_writable(folder, error) from error
        else:
            return [folder, *new]


def _check_model(out: Path, model: Path) -> None:
    """Refuse a folder with results of another model, which would be replaced."""
    source = source_of(model)
    for record in records(out).values():
        other = record["model"]
        if source["path"] != other["path"] and source["sha256"] != other["sha256"]:
            raise UsageError(
                f"--out {out} holds results of another model, {other['path']}. A folder of its "
                "own is needed, since files of one name would be replaced: leave out --out, or "
                f"give --out {out}_{model.resolve().stem}."
            )


def records(folder: Path) -> Json:
    """Records of the runs in a folder, by command; empty where there are none that can be read."""
    try:
        content = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    known = isinstance(content, dict) and all(
        isinstance(record, dict) and {"model", "files"} <= set(record)
        for record in content.values()
    )
    return content if known else {}


def source_of(model: Path) -> Mapping[str, str]:
    """Path and hash of a model file, or of `case.json` of a folder."""
    return identified(model / "case.json" if model.is_dir() else model)


def identified(path: Path) -> Mapping[str, str]:
    """Path and SHA-256 of a file; the latter is empty where there is none."""
    if not path.is_file():
        return {"path": str(path.resolve()), "sha256": ""}
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return {"path": str(path.resolve()), "sha256": digest}


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
            typer.echo(printable(words), err=True)
        yield
    finally:
        with suppress(OSError):  # somebody took the folder away
            path.unlink()  # while it is still locked
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
        if _leads_to(path, handle):
            return handle
        os.close(handle)  # the run before this one has just ended


def _leads_to(path: Path, handle: int) -> bool:
    """Whether a path still leads to an open file."""
    try:
        return os.path.samestat(os.fstat(handle), path.stat())
    except FileNotFoundError:
        return False


def _in_use(out: Path, path: Path) -> UsageError:
    try:
        whose = f" ({path.read_text(encoding='utf-8', errors='replace').strip()})"
    except OSError:  # it has just ended
        whose = ""
    return UsageError(
        f"--out {out} is in use by another run{whose}; one run at a time is needed, since both "
        f"would write the same files. Wait until it ends, or give another folder: --out {out}-2."
    )


def _check_room(out: Path) -> None:
    usage = shutil.disk_usage(out)
    if usage.total and usage.free < LEAST_ROOM:
        raise UsageError(
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


def _not_writable(out: Path, error: OSError) -> UsageError:
    return UsageError(
        f"--out {out} cannot be written to ({error.strerror}); a folder that can be is needed "
        "before anything is computed, since results are written there: --out ~/results."
    )


def _versions(out: Path) -> dict[Path, tuple[int, int]]:
    """Files below a folder, each with what changes when it is written anew."""
    files = (path for path in out.rglob("*") if path.is_file())
    files = (path for path in files if path.name not in (RUNNING, RECORD))
    stats = {path: path.stat() for path in files if UNFINISHED not in path.name}
    return {path: (stat.st_ino, stat.st_mtime_ns) for path, stat in stats.items()}


def _words_on_kept(results: ResultFolder, before: dict[Path, tuple[int, int]]) -> str:
    """Sentence on the files that a run wrote until it was stopped."""
    out, after = results.path, _versions(results.shared)
    written = sorted(path for path, version in after.items() if before.get(path) != version)
    if not written:
        return f"Stopped. Nothing of this run is in {out} yet."
    names = [path.name for path in written if path.parent == out]
    parents = (path.parent for path in written if path.parent != out)
    folders = Counter(
        folder.relative_to(out) if folder.is_relative_to(out) else folder for folder in parents
    )
    more = [f"{len(names) - SHOWN} more"] if len(names) > SHOWN else []
    parts = [*names[:SHOWN], *more, *(f"{count} in {folder}/" for folder, count in folders.items())]
    return f"Stopped. What was finished is complete and stays in {out}: {', '.join(parts)}."
