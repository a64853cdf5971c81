"""`bayes-placement results`, and the user's cache: what earlier runs left, how old and how large.

What is in the cache can be made again. All commands import this file: nothing that takes long.
"""

import hashlib
import os
import re
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ._result_folder import RECORD, RESULTS

if TYPE_CHECKING:
    from ._terminal import Screen

DAY, MEGABYTE = 86400.0, 1e6


def run(folder: Path | None, clean: bool, screen: "Screen") -> None:
    """List the results of each model, and the fits of all; delete these where that is asked for.

    No result depends on fits. The folder has one for each model, by default `results`.
    """
    import pandas as pd

    top = RESULTS if folder is None else folder
    table = pd.DataFrame.from_dict(dict(_kept_in(top)), orient="index")
    fits = files_of_fits()
    if len(table):
        screen.table(table, "model")
    else:
        screen.text(f"No results are in {top}/.")
    verdict = _verdict(fits, clean)  # before they are deleted, with their size
    if clean:
        for file in fits:
            file.unlink(missing_ok=True)
    screen.always(verdict)
    rows = table.rename_axis("model").reset_index().to_dict("records")
    answer = {"command": "results", "finished": True, "verdict": verdict, "exit_code": 0}
    screen.json(
        {**answer, "files": [], "folder": str(top), "result": {"models": rows, "fits": len(fits)}}
    )


def _kept_in(top: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """Name of each model of which there are runs: their number, age of the latest, and sizes."""
    for folder in sorted(path for path in top.glob("*") if path.is_dir()):
        runs = [path.parent for path in folder.glob(f"*/{RECORD}")]
        if runs:
            files = [file for run in runs for file in run.rglob("*") if file.is_file()]
            yield (
                folder.name,
                {
                    "runs": str(len(runs)),
                    "latest [days]": f"{min(map(_age, runs)):.1f}",
                    "results [MB]": f"{_megabytes(files):.1f}",
                },
            )


def _verdict(fits: list[Path], clean: bool) -> str:
    """Number, size, age and place of fits, and what becomes of them."""
    if not fits:
        return f"No fits are kept in {cache_home()}."
    ages = sorted(map(_age, fits))
    size = f"{len(fits)} fit{'s' * (len(fits) > 1)}, {_megabytes(fits):.1f} MB"
    told = f"{size}, the oldest of {ages[-1]:.1f} days, in {cache_home()}"
    return f"Deleted: {told}." if clean else f"{told}; --clean deletes them, results stay."


def _age(path: Path) -> float:
    """Time since it was written last [days]; 0 once another run has deleted it."""
    try:
        return (time.time() - path.stat().st_mtime) / DAY
    except FileNotFoundError:
        return 0.0


def _megabytes(files: list[Path]) -> float:
    return sum(file.stat().st_size for file in files if file.exists()) / MEGABYTE


OLDEST_FILE = 60 * 86400.0
"""Age [s] at which a file of the cache is deleted."""


def cache_folder(name: str) -> Path | None:
    """Make a folder that its owner alone may write; None where none can be made.

    What it holds is executed, or believed without being computed again.
    """
    try:
        folder = cache_home() / name
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # read-only; no home directory
        return None
    return folder if os.access(folder, os.W_OK) else None


def cache_home() -> Path:
    """Folder of this package in the cache directory."""
    return cache_directory() / "bayes_placement"


def cache_directory() -> Path:
    """Cache directory of the user, by the convention of the operating system."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def _hash_of_package() -> str:
    """Hash of the files of this package: what another state of it has computed may differ."""
    top = Path(__file__).parents[1]
    files = sorted(top.rglob("*.py"))
    states = [(str(file.relative_to(top)), file.stat()) for file in files]
    known = [(name, state.st_size, state.st_mtime_ns) for name, state in states]
    return hashlib.sha256(repr(known).encode()).hexdigest()[:12]


def delete_old_files(files: Iterable[Path]) -> None:
    """Delete those that were written long ago."""
    for file in files:
        try:
            if time.time() - file.stat().st_mtime > OLDEST_FILE:
                file.unlink()
        except OSError:  # another run deletes it, or the folder is read-only
            continue


def folder_of_fits() -> Path | None:
    """Folder of the fits of all models; None where none can be made.

    Each is named by a hash of all that it follows from, and the folder by the state of the package.
    """
    folder = cache_folder(f"fits-{_hash_of_package()}")
    if folder is not None:
        delete_old_files(files_of_fits())
    return folder


def files_of_fits() -> list[Path]:
    """Files of fits of any state of the package; their names are hashes."""
    files = cache_home().glob("fits-*/*.npz")
    return [file for file in files if re.fullmatch(r"[0-9a-f]{64}", file.stem)]
