"""What every command begins with: its folder, errors for people, and compiled functions."""

import gc
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ._errors import errors_in_words

if TYPE_CHECKING:
    from ._run import Output


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
            from ._compilation_cache import use_compilation_cache
            from ._user_cache import folder_of_fits

            use_compilation_cache()
            fits = folder_of_fits()
        from .._shared.processes import begin_with_helpers, collect_garbage_rarely

        collect_garbage_rarely()
        if options.searches:
            begin_with_helpers("bayes_placement.criticism.missing")
        from ._result_folder import result_folder

        out = None if options.out is None else options.out.absolute()
        with result_folder(options.model.absolute(), options.command, out) as folder:
            from ._run import Output

            yield Output(folder, options.quiet, options.as_json, options.report, fits)
    gc.freeze()  # or Python looks for garbage among all that it frees at its end anyway
