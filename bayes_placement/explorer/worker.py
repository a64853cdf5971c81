"""A process that fits and searches, so that the page never waits, and that can be stopped.

Both processes have the same large arrays, which messages do not send again: a finite element model
has some 30 MB of them, and each copy that a message made would stay.
"""

import hashlib
import io
import operator
import os
import pickle
import signal
import struct
import subprocess
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from threading import Lock, Thread
from typing import IO, Any, NamedTuple, TypeAlias

import cloudpickle
import jax
import numpy as np

from .._shared.errors import PackageError
from .._shared.processes import SETTINGS
from ..experiment.experiment import Experiment, Measurements

LENGTH = struct.Struct("<Q")
"""Length of a message in bytes, ahead of it."""

CODE = "from bayes_placement.explorer.worker_process import serve; serve()"

NICE = 5
"""By how much the worker gives way to the page."""


LOST = (
    "The process that fitted and searched has ended: other programs may have needed its memory. "
    "The next task starts it again."
)
"""What is said of tasks that a worker left undone."""


class Told(NamedTuple):
    """What a worker tells of a task."""

    number: int
    """Number of the task."""
    word: str
    """`progress` with a share, `seen` with values of a fit, `step` with a model of a search, `done`
    with the result, or `failed` with a sentence."""
    content: Any
    """The same."""


def failure(error: Exception) -> str:
    """Say what has failed; where the error is none of ours, its traceback goes to the terminal."""
    if isinstance(error, PackageError):
        return str(error)
    traceback.print_exception(error)
    reason = f"{type(error).__name__}: {' '.join(str(error).split())}"
    return f"This failed: {reason}. Please report it."


ENDS = ("done", "failed")
"""Words of these with which a task ends."""


class AskedOfWorker(NamedTuple):
    """What a task is about."""

    experiment: Experiment
    measurement: Measurements
    """The model with its effects, and what was measured."""
    baseline: Measurements | None
    """An earlier state, or None."""
    store: Path | None
    """Folder in which fits are kept, or None."""


Task: TypeAlias = tuple[int, str, AskedOfWorker | None, Mapping[str, object]]
"""Number and name of a task, what it is about where that is new, and its arguments."""


LARGE = 50_000
"""Bytes from which on an array is large."""

AnyArray: TypeAlias = np.ndarray | jax.Array


class SharedArrays:
    """Writes and reads objects of Python whose large arrays may be among those shared."""

    def __init__(self, arrays: Sequence[AnyArray]):
        self._arrays = arrays
        self._numbers = {_hash(array): number for number, array in enumerate(arrays)}

    def dumps(self, content: object) -> bytes:
        """Return an object as bytes; of arrays that are shared, their numbers."""
        file = io.BytesIO()
        _Pickler(file, lambda array: self._numbers.get(_hash(array))).dump(content)
        return file.getvalue()

    def loads(self, text: bytes) -> Any:
        """Return the object."""
        return _Unpickler(text, self._arrays).load()


def large_arrays(content: object) -> list[AnyArray]:
    """Return the large arrays of an object, which may be anywhere in it."""
    found: dict[bytes, AnyArray] = {}

    def note(array: AnyArray) -> int:
        found.setdefault(_hash(array), array)
        return 0  # so that none is written

    _Pickler(io.BytesIO(), note).dump(content)
    return [*found.values()]


class _Pickler(cloudpickle.Pickler):
    """Writes numbers in place of large arrays, where they have one."""

    def __init__(self, file: io.BytesIO, number_of: Callable[[AnyArray], int | None]):
        cloudpickle.Pickler.__init__(self, file)
        self._number_of = number_of

    def persistent_id(self, content: object) -> int | None:
        """Number of a large array that is shared; None for all else, which is written."""
        if not isinstance(content, AnyArray) or content.nbytes < LARGE:
            return None
        return self._number_of(content)


class _Unpickler(pickle.Unpickler):
    """Reads arrays by their numbers."""

    def __init__(self, text: bytes, arrays: Sequence[AnyArray]):
        pickle.Unpickler.__init__(self, io.BytesIO(text))
        self._arrays = arrays

    def persistent_load(self, number: int) -> AnyArray:
        """Array of a number."""
        return self._arrays[number]


def _hash(array: AnyArray) -> bytes:
    """Hash of numbers, shape and kind of an array."""
    content = np.ascontiguousarray(array)
    words = f"{type(array).__module__} {content.dtype} {content.shape}".encode()
    found = hashlib.blake2b(words, digest_size=16)
    found.update(content.reshape(-1).view(np.uint8).data)
    return found.digest()


class Worker:
    """A process that does one task after the other; it starts with the first.

    `hear` is called, in a thread, with all that it tells.
    """

    def __init__(self, hear: Callable[[Told], None]):
        self._hear, self._lock, self._count = hear, Lock(), 0
        self._process: subprocess.Popen[bytes] | None = None
        self._asked: AskedOfWorker | None = None
        self._messages: SimpleQueue[Task | None] = SimpleQueue()
        self._undone: set[int] = set()

    def begin(self, task: str, asked: AskedOfWorker, **arguments: object) -> int:
        """Begin a task of `worker_process.TASKS`, and return its number."""
        with self._lock:
            self._count += 1
            self._start(asked)
            self._undone.add(self._count)
            is_there = self._asked is not None and all(map(operator.is_, asked, self._asked))
            self._messages.put((self._count, task, None if is_there else asked, arguments))
            self._asked = asked
            return self._count

    def stop(self) -> None:
        """End the process and all that it has started; what it was at is lost."""
        with self._lock:
            process, self._process = self._process, None
            self._undone.clear()
            self._messages.put(None)
        if process is not None:
            _end(process)

    def _start(self, asked: AskedOfWorker) -> None:
        """Start the process, unless it is there; it keeps the large arrays of what it is asked."""
        if self._process is not None and self._process.poll() is None:
            return
        process = self._process = subprocess.Popen(
            [sys.executable, "-c", CODE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
        )
        assert process.stdin is not None and process.stdout is not None
        # It takes seconds to begin to read, and a pipe holds less than a measurement.
        self._messages, self._asked, self._undone = SimpleQueue(), None, set()
        # The path of a model file goes along: it may import from its folder.
        arrays = large_arrays(asked)
        settings = {name: jax.config.values[name] for name in SETTINGS}
        begin = {"path": sys.path, "settings": settings, "arrays": arrays}
        shared = SharedArrays(arrays)
        written = process.stdin, cloudpickle.dumps(begin), shared, self._messages
        Thread(target=_write_all, args=written, daemon=True).start()
        listened = process, process.stdout, shared, self._undone
        Thread(target=self._listen, args=listened, daemon=True).start()

    def _listen(
        self,
        process: "subprocess.Popen[bytes]",
        stream: IO[bytes],
        shared: SharedArrays,
        undone: set[int],
    ) -> None:
        with stream:
            while (message := read(stream)) is not None:
                told = Told(*shared.loads(message))
                if told.word in ENDS:
                    undone.discard(told.number)
                self._hear(told)
        process.wait()  # a task that follows needs another one
        for number in sorted(undone):
            self._hear(Told(number, "failed", LOST))


def _write_all(
    stream: IO[bytes], begin: bytes, shared: SharedArrays, messages: "SimpleQueue[Task | None]"
) -> None:
    """Write messages one after the other, until one is None or the process has ended."""
    with suppress(OSError), stream:
        write(stream, begin)
        while (message := messages.get()) is not None:
            write(stream, shared.dumps(message))


def write(stream: IO[bytes], text: bytes) -> None:
    """Write a message to another process."""
    stream.write(LENGTH.pack(len(text)) + text)
    stream.flush()


def read(stream: IO[bytes]) -> bytes | None:
    """Read a message of a process that we started; None where it has ended."""
    head = stream.read(LENGTH.size)
    if len(head) < LENGTH.size:
        return None
    (length,) = LENGTH.unpack(head)
    content = stream.read(length)
    return content if len(content) == length else None


def _end(process: "subprocess.Popen[bytes]") -> None:
    with suppress(ProcessLookupError, PermissionError):
        if sys.platform == "win32":
            process.kill()
        else:
            os.killpg(process.pid, signal.SIGKILL)
    process.wait()
