"""Folders in the user's cache directory: what is in them can be made again."""

import hashlib
import os
import re
import sys
import time
from collections.abc import Iterable
from pathlib import Path

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
