"""Errors of a command: our own in one sentence, those of the user's model with their traceback."""

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

import typer

PACKAGE = Path(__file__).parents[1]
REFUSED, FAILED = 2, 1
"""Exit codes: what was given cannot be treated; the user's model or this package failed."""


@contextmanager
def errors_in_words(model: Path, *, show_traceback: bool) -> Iterator[None]:
    """End a command with what helps the user most.

    Errors of this package, and files that cannot be read or written, are one sentence. Errors in
    the user's model file keep their traceback, from the line of that file on; all other errors
    keep all of it.

    Parameters
    ----------
    model
        The model file.
    show_traceback
        Whether the traceback is shown in any case.
    """
    try:
        yield
    except Exception as error:
        if show_traceback:
            raise
        if _is_ours(error, model):
            typer.secho(f"error: {_place(error, model)}{error}", err=True, fg="red")
            raise typer.Exit(REFUSED) from error
        frames = _from_model(error, model)
        if frames is None:
            raise
        text = traceback.format_exception(type(error), error, frames)
        typer.echo("".join(text), err=True, nl=False)
        raise typer.Exit(FAILED) from error


def _is_ours(error: Exception, model: Path) -> bool:
    from .._types import PackageError

    if isinstance(error, PackageError):
        return True
    if not isinstance(error, OSError):
        return False
    raised_in = traceback.extract_tb(error.__traceback__)[-1].filename
    return _from_model(error, model) is None or PACKAGE in Path(raised_in).parents


def _from_model(error: Exception, model: Path) -> TracebackType | None:
    """Traceback from the first line of the model file on; None where it has no part in it."""
    frames = error.__traceback__
    while frames is not None and Path(frames.tb_frame.f_code.co_filename) != model.resolve():
        frames = frames.tb_next
    return frames


def _place(error: Exception, model: Path) -> str:
    """Line of the user's files in which an error came up, if it did in one."""
    lines = [
        f"{Path(frame.filename).name}, line {frame.lineno}: "
        for frame in traceback.extract_tb(_from_model(error, model))
        if model.resolve().parent in Path(frame.filename).parents
    ]
    return lines[-1] if lines else ""
