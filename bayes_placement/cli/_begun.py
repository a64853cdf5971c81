"""What every command begins with: its folder, errors for people, and compiled functions."""

import hashlib
import os
import platform
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ._errors import errors_in_words
from ._user_cache import cache_folder, delete_old_files

if TYPE_CHECKING:
    from ._run import Output

OF_HELPERS = (
    "bayes_placement.criticism.missing.improve",
    "bayes_placement.plots.ledger",
    "matplotlib.backends.backend_agg",
)
"""What helpers need for a search and its figures; they import it while the model is read."""


class Common(NamedTuple):
    """What every command is given."""

    model: Path
    command: str
    out: Path | None
    quiet: bool
    as_json: bool
    report: bool
    no_cache: bool
    traceback: bool
    searches: bool


@contextmanager
def begun(options: Common) -> Iterator["Output"]:
    """Run a command in its folder, with the compilation cache, and with errors for people."""
    with errors_in_words(options.model, show_traceback=options.traceback, as_json=options.as_json):
        # Zeros and overflows within this package and its libraries are treated where they occur;
        # those of a model file are the user's to see.
        warnings.filterwarnings(
            "ignore", category=RuntimeWarning, module=r"(?!_model_)", append=True
        )
        fits = None
        if not options.no_cache:
            from ._user_cache import folder_of_fits

            use_compilation_cache()
            fits = folder_of_fits()
        if options.searches:
            from .._shared.processes import begin_with_helpers

            begin_with_helpers(*OF_HELPERS)
        from ._result_folder import result_folder

        out = None if options.out is None else options.out.absolute()
        with result_folder(options.model.absolute(), options.command, out) as folder:
            from ._run import Output

            yield Output(folder, options.quiet, options.as_json, options.report, fits)


SHORTEST_COMPILATION = 0.01
"""Compilations that take less [s] are not worth a file: one is read in some milliseconds."""


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
    folder = cache_folder(f"jax-{jax.__version__}-{_processor()}")
    if folder is None:
        return
    delete_old_files(folder.parent.glob("jax-*/*-cache"))
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    # A file that another run is just writing cannot be read; the function is then compiled.
    warnings.filterwarnings(
        "ignore", message=".*persistent compilation cache", category=UserWarning, append=True
    )


def _processor() -> str:
    """Name of a processor and its instructions: others may not run what was compiled for it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    instructions = [line for line in lines if line.startswith(("flags", "Features"))]
    known = [platform.machine(), platform.processor(), *instructions[:1]]
    return hashlib.sha256(" ".join(known).encode()).hexdigest()[:12]
