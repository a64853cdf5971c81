"""The program `bayes-placement`: what is true of it from its first word to its exit code."""

import gc
import os
import signal
import sys
import threading
import time
import warnings
from types import FrameType
from typing import NoReturn

from .._shared.garbage import collect_garbage_rarely
from ._errors import MODEL_FAILS, UNPRINTED, StoppedBySignal
from ._streams import LastingStream, lasting_streams, printable, printable_warning
from .app import app

ENDING = ("SIGTERM", "SIGHUP")
"""Signals by which systems end a program: they end it as Ctrl-C does."""


PATIENCE = 5.0
"""Time [s] in which threads may end, once the command has."""


def run() -> NoReturn:
    """Run a command with words of the command line, and end the process with its exit code."""
    collect_garbage_rarely()
    output = lasting_streams()
    warnings.formatwarning = printable_warning
    for name in ENDING:
        number = getattr(signal, name, None)  # Windows has no SIGHUP; `nohup` ignores it
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _stop)
    try:
        app(prog_name="bayes-placement")
    except SystemExit as ended:
        _leave(_code(ended.code, output))
    raise AssertionError("a command ends by its exit code")


def _stop(number: int, frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_DFL)  # a second one ends at once
    raise StoppedBySignal(128 + number)


def _code(code: str | int | None, output: LastingStream | None) -> int:
    """Exit code of a command, another one where not all of its words could be printed."""
    number = int(code or 0)
    sys.stdout.flush()
    if output is None or output.fault is None or number not in (0, MODEL_FAILS):
        return number
    sys.stderr.write(
        f"error: standard output could not be written to ({output.fault.strerror}); what was left "
        "to print is lost. The command went on: files of results are complete, and run.json among "
        "them tells the verdict.\n"
    )
    return UNPRINTED


def _leave(code: int) -> NoReturn:
    """End the process, even where a thread, as of the model file, goes on for ever."""
    gc.freeze()  # or Python looks for garbage among all that it frees at its end anyway
    threading.Thread(target=_end, args=(code,), daemon=True).start()
    sys.exit(code)


def _end(code: int) -> None:
    time.sleep(PATIENCE)
    ours = threading.main_thread()
    going_on = [one.name for one in threading.enumerate() if one is not ours and not one.daemon]
    if going_on:
        words = printable(f"The program ends; a thread goes on: {', '.join(going_on)}.\n")
        sys.stderr.write(words)
        sys.stderr.flush()
    os._exit(code)
