"""Errors of a command in words, and its exit codes."""

import errno
import json
import sysconfig
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

import typer

from .._shared.errors import in_commands
from ._streams import answer_alone, begin_here, print_answer, printable

PACKAGE = Path(__file__).parents[1]

MODEL_FAILS, USAGE, REFUSED, FAILED, UNPRINTED, STOPPED = 1, 2, 3, 4, 5, 130
"""Exit codes besides 0: the model fails its check; the command was typed wrongly; the model file
or the data are refused; this program or the system failed; standard output could not be written to;
Ctrl-C."""


class StoppedBySignal(KeyboardInterrupt):
    """A signal that ends a command as Ctrl-C does; its argument is the exit code."""


EXHAUSTED = "RESOURCE_EXHAUSTED"
"""What JAX says where it finds no memory."""

TOO_LITTLE_MEMORY = (
    "There is too little memory ({}); as much is needed, since all modes, lines and draws are "
    "computed at once. Take fewer of them, or another computer."
)

LONGEST_PATH = 200
"""Letters of a path that are told."""

ABOUT_FRAMES_OF_JAX = "JAX_TRACEBACK_FILTERING"
"""In a note that JAX adds to errors about frames that are not shown."""


@contextmanager
def errors_in_words(
    model: Path, *, show_traceback: bool = False, as_json: bool = False
) -> Iterator[None]:
    """End a command with what helps the user most.

    Errors of this package, and files that cannot be read or written, are one sentence. Errors in
    the user's model file keep the part of their traceback that is in the user's files; all other
    errors keep all of it.

    An object of JSON with the error goes to standard output too, where that is asked for.
    """
    try:
        begin_here()
        model = model.resolve()
        with answer_alone(as_json):
            yield
    except (typer.Exit, typer.Abort):
        raise
    except KeyboardInterrupt as error:
        code = error.args[0] if isinstance(error, StoppedBySignal) else STOPPED
        (words,) = getattr(error, "__notes__", ["Stopped before anything was computed."])
        _say(f"{words} Run it again to go on.", code, as_json)
        raise typer.Exit(code) from None
    except BaseException as error:  # noqa: BLE001, a function of a model file may raise SystemExit
        code, words = _in_words(error, model, show_traceback)
        _say(words, code, as_json)
        raise typer.Exit(code) from None  # where the cause is StopIteration, `with` raises that


def _in_words(error: BaseException, model: Path, show_traceback: bool) -> tuple[int, str]:
    """Exit code and text of an error."""
    if _is_ours(error, model):
        code, words = _code(error), f"error: {_place(error, model)}{_sentence(error)}"
    elif _is_of_model(error, model):
        code, words = REFUSED, "".join(_model_traceback(error, model))
    elif isinstance(error, MemoryError) or EXHAUSTED in str(error):
        code, words = FAILED, f"error: {TOO_LITTLE_MEMORY.format(error)}"
    else:
        code, words = FAILED, _traceback(error)
    return code, _traceback(error) if show_traceback else words


def _code(error: BaseException) -> int:
    """Exit code of an error of this package, or of a file that cannot be read."""
    from .._shared.errors import InputError, UsageError

    is_too_long = isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG
    if is_too_long or isinstance(error, UsageError | FileNotFoundError | IsADirectoryError):
        return USAGE
    return REFUSED if isinstance(error, InputError) else FAILED


def _sentence(error: BaseException) -> str:
    """Sentence of an error; of one of the system, what it could not do to which file."""
    if not isinstance(error, OSError) or error.strerror is None:
        return in_commands(str(error))
    name = f"{str(error.filename)[:LONGEST_PATH]}: " if error.filename else ""
    return (
        f"{name}the system says {error.strerror!r}; a file or folder that can be opened is needed, "
        "since it is read or written. Correct its path, or its permissions."
    )


def _say(words: str, code: int, as_json: bool) -> None:
    if as_json:
        print_answer(json.dumps({"error": words, "exit_code": code}))
    shown = printable(words.rstrip())
    typer.secho(shown, err=True, fg="red" if words.startswith("error") else None)


def _traceback(error: BaseException) -> str:
    return "".join(traceback.format_exception(error))


def _is_ours(error: BaseException, model: Path) -> bool:
    from .._shared.errors import PackageError

    if isinstance(error, PackageError):
        return True
    if not isinstance(error, OSError):
        return False
    raised_in = traceback.extract_tb(error.__traceback__)[-1].filename
    return _from_model(error, model) is None or PACKAGE in Path(raised_in).parents


def _from_model(error: BaseException, model: Path) -> TracebackType | None:
    """Traceback from the first line of the model file on; None where it has no part in it."""
    frames = error.__traceback__
    while frames is not None and Path(frames.tb_frame.f_code.co_filename) != model:
        frames = frames.tb_next
    return frames


def _is_of_model(error: BaseException, model: Path) -> bool:
    """Whether an error came up in the model file, or in something that it called."""
    if isinstance(error, SyntaxError) and error.filename == str(model):
        return True
    return _from_model(error, model) is not None


def _model_traceback(error: BaseException, model: Path) -> Iterator[str]:
    """Lines of the traceback in files of the user; of libraries that they call the error alone."""
    told = traceback.TracebackException(type(error), error, _from_model(error, model))
    told.stack = traceback.StackSummary.from_list(
        [frame for frame in told.stack if _is_of_user(frame.filename)]
    )
    notes = told.__notes__ or []
    told.__notes__ = [note for note in notes if ABOUT_FRAMES_OF_JAX not in note]
    return told.format(chain=False)


def _is_of_user(file: str) -> bool:
    paths = sysconfig.get_paths()
    folders = {Path(paths[name]) for name in ("stdlib", "platstdlib", "purelib", "platlib")}
    return not file.startswith("<") and not {PACKAGE, *folders} & {*Path(file).parents}


def _place(error: BaseException, model: Path) -> str:
    """Line of the user's files in which an error came up, if it did in one."""
    lines = [
        f"{Path(frame.filename).name}, line {frame.lineno}: "
        for frame in traceback.extract_tb(_from_model(error, model))
        if model.parent in Path(frame.filename).parents
    ]
    return lines[-1] if lines else ""
