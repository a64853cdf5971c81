"""JAX's compilation cache in the user's cache directory: a second run need not compile again."""

import hashlib
import os
import platform
import sys
import time
import warnings
from pathlib import Path

SHORTEST_COMPILATION = 0.01
"""Compilations that take less [s] are not worth a file: one is read in some milliseconds."""

OLDEST_FILE = 60 * 86400.0
"""Age [s] at which a file of the cache is deleted."""


def use_compilation_cache() -> None:
    """Keep compiled functions in a folder of the user's cache directory.

    A cache that the user has chosen (the environment variable JAX_COMPILATION_CACHE_DIR) is used as
    it is; where no folder can be made, there is none.
    """
    # XLA reports every difference between two processors as an error, although it checks them. It
    # reads this when JAX is imported.
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    import jax

    if "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS" not in os.environ:
        jax.config.update("jax_persistent_cache_min_compile_time_secs", SHORTEST_COMPILATION)
    if jax.config.values["jax_compilation_cache_dir"]:
        return
    folder = _folder(jax.__version__)
    if folder is None:
        return
    _delete_old_files(folder.parent)
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    # A file that another run is just writing cannot be read; the function is then compiled.
    warnings.filterwarnings(
        "ignore", message=".*persistent compilation cache", category=UserWarning, append=True
    )


def _folder(version: str) -> Path | None:
    """Folder for this version of JAX and this processor; None where none can be made."""
    try:
        folder = cache_directory() / "bayes_placement" / f"jax-{version}-{_processor()}"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)  # what it holds is executed
    except (OSError, RuntimeError):  # read-only; no home directory
        return None
    return folder


def cache_directory() -> Path:
    """Cache directory of the user, by the convention of the operating system."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def _processor() -> str:
    """Name of a processor and its instructions: others may not run what was compiled for it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    instructions = [line for line in lines if line.startswith(("flags", "Features"))]
    known = [platform.machine(), platform.processor(), *instructions[:1]]
    return hashlib.sha256(" ".join(known).encode()).hexdigest()[:12]


def _delete_old_files(folder: Path) -> None:
    for file in folder.glob("*/*-cache"):
        try:
            if time.time() - file.stat().st_mtime > OLDEST_FILE:
                file.unlink()
        except OSError:  # another run deletes it, or the folder is read-only
            continue
