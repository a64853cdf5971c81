"""What a command prints, and where: text that is safe to show, on streams that do not fail."""

import io
import os
import re
import sys
import unicodedata
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TextIO

_ANSWER: ContextVar[TextIO | None] = ContextVar("_ANSWER", default=None)
_FORMATTED = warnings.formatwarning
_BEGAN_IN: ContextVar[str] = ContextVar("_BEGAN_IN", default="")


class LastingStream(io.RawIOBase):
    """A descriptor to which writing never fails: what cannot be written is lost.

    It is a copy, so that what is printed past Python can be sent elsewhere.
    """

    def __init__(self, descriptor: int):
        self._descriptor = os.dup(descriptor)
        self.fault: OSError | None = None
        """Why something was lost; None where nothing was."""

    def writable(self) -> bool:
        """Tell that it can be written to."""
        return True

    def isatty(self) -> bool:
        """Whether it is a terminal."""
        return os.isatty(self._descriptor)

    def fileno(self) -> int:
        """Its descriptor."""
        return self._descriptor

    def write(self, content: Any) -> int:
        """Write bytes; after a fault they vanish."""
        if self.fault is None:
            try:
                return os.write(self._descriptor, content)
            except OSError as error:
                self.fault = error
        return len(content)


class _LastingText(io.TextIOWrapper):
    """Text on a lasting stream, which a model file may close without harm."""

    def close(self) -> None:
        self.flush()


def lasting_streams() -> LastingStream | None:
    """Let standard output and error never fail, whatever is printed; return the former.

    A pager that ends, a full disk or an encoding without Greek letters are no reason to end a
    search. None where whoever started this process closed standard output.
    """
    error, output = _lasting("stderr"), _lasting("stdout")
    return output if error or output else None


def _lasting(name: str) -> LastingStream | None:
    stream = getattr(sys, name)
    if stream is None:  # or its number would become that of a file of results
        nowhere = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115  open to the end
        setattr(sys, name, nowhere)
        return None
    stream.flush()
    raw = LastingStream(stream.fileno())
    text = _LastingText(
        io.BufferedWriter(raw),
        encoding=stream.encoding,
        errors="backslashreplace",
        line_buffering=stream.line_buffering,
    )
    setattr(sys, name, text)
    return raw


@contextmanager
def answer_alone(as_json: bool) -> Iterator[None]:
    """Send all that is printed meanwhile but the answer to standard error, where that is JSON."""
    if not as_json:
        yield
        return
    output, raw = sys.stdout, getattr(getattr(sys.stdout, "buffer", None), "raw", None)
    if isinstance(raw, LastingStream):  # what is printed past Python, and by helpers, too
        os.dup2(sys.stderr.fileno(), 1)
    token = _ANSWER.set(output)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        _ANSWER.reset(token)


def print_answer(text: str) -> None:
    """Print the answer of a command to standard output."""
    stream = _ANSWER.get() or sys.stdout
    stream.write(f"{text}\n")
    stream.flush()


def begin_here() -> None:
    """Show paths below the present folder from there, wherever a model file goes later."""
    try:
        _BEGAN_IN.set(str(Path.cwd()))
    except FileNotFoundError as error:
        from .._shared.errors import UsageError  # with JAX

        raise UsageError(
            "The folder in which the command was typed was deleted; one that is there is needed, "
            "since results are written below it: cd ~"
        ) from error


def printable(text: object) -> str:
    """Text without what a terminal takes for orders, paths as they may be typed."""
    shown = str(text)
    if _BEGAN_IN.get():
        shown = re.sub(rf"(?<![\w./\\-]){re.escape(_BEGAN_IN.get())}{re.escape(os.sep)}", "", shown)
    return shown if shown.isprintable() else "".join(map(_shown, shown))


def printable_warning(*warning: Any, **line: Any) -> str:
    """A warning as Python writes it, which may name files and what is in them."""
    return printable(_FORMATTED(*warning, **line))


def _shown(letter: str) -> str:
    """A letter; what steers a terminal or has no shape is written as in Python."""
    if letter in "\n\t" or unicodedata.category(letter)[0] != "C":
        return letter
    return letter.encode("unicode_escape").decode()
