"""Parts of work, done by this process and its helpers, or by any executor.

All that takes long hands out its parts here. Results follow from the arguments of a part alone, so
that they are the same wherever it is done, and however often.
"""

import contextlib
import functools
import pickle
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    wait,
)
from contextvars import ContextVar
from threading import RLock
from typing import Any, Generic, TypeVar

import cloudpickle

from . import processes
from .errors import WorkerError

Result = TypeVar("Result")
Task = tuple[object, ...]

IN_FLIGHT = 200
"""Parts submitted at once: enough for as many workers, few enough for a scheduler."""

COMPILED_IN = 5.0
"""Time [s] that a helper may take to compile what is already compiled here."""

TRIES = 4
"""How often a part is given to an executor that loses its worker."""

LOST = (
    "A worker was lost, or the scheduler, and the executor cannot go on. Parts that were finished "
    "are in the store, if one was given: run again with the same store=... and a new executor, and "
    "only what is missing is computed. Where every worker is lost at once, look at what it said: "
    'it may lack memory, or a script lacks its line `if __name__ == "__main__":`.'
)

PROCESS = uuid.uuid4().hex
"""Name of this process: numbers of processes occur on every machine."""

_EXECUTOR: ContextVar[Executor | None] = ContextVar("executor", default=None)

_COMPUTING = RLock()
"""Held by what computes: two threads of a process take longer than one, and can wait for each
other for ever."""


def nothing() -> None:
    """Do nothing."""


@contextlib.contextmanager
def done_by(executor: Executor | None) -> Iterator[None]:
    """Give all parts of what follows to an executor; None changes nothing."""
    token = _EXECUTOR.set(executor or _EXECUTOR.get())
    try:
        yield
    finally:
        _EXECUTOR.reset(token)


def executor_of_parts() -> Executor | None:
    """Return what parts are given to just now; None where this process and its helpers do them."""
    return _EXECUTOR.get()


def shared(
    function: Callable[..., Result],
    tasks: Sequence[Task],
    done: Callable[[int], None],
    meanwhile: Callable[[], object] = nothing,
) -> list[Result]:
    """Call a function with the arguments of each task, by the executor, or here and by helpers.

    Helpers are as many as there are further cores, at most three; LOKY_MAX_CPU_COUNT=1 in the
    environment lets a search run in one process. A task that a helper cannot do is done here: what
    it raises is raised here. A task whose worker is lost is given to the executor again. Tasks that
    take longest come first; each that is done is told by its number. What this process does
    meanwhile it does first, once others have begun.
    """
    results: dict[int, Result] = {}
    for number, result in shared_in_any_order(function, tasks, meanwhile):
        results[number] = result
        done(number)
    return [results[number] for number in range(len(tasks))]


def shared_in_any_order(
    function: Callable[..., Result],
    tasks: Sequence[Task],
    meanwhile: Callable[[], object] = nothing,
) -> Iterator[tuple[int, Result]]:
    """Number and result of each task as soon as it is done; all else is as in `shared`.

    Within what is done meanwhile all others are at work: helpers take a part of it once they have
    nothing else to do, and more is left than they take to compile it.
    """
    queue = _Queue(function, tasks, *_workers(len(tasks)))
    with queue.at_work():
        with _COMPUTING:  # before threads of an executor have it: they would never let go
            queue.hand_out()
            meanwhile()
        yield from queue.results()


def begun_in_helper(function: Callable[..., Result], *arguments: object) -> Callable[[], Result]:
    """Begin a task in a helper, and return what awaits its result; what it raises is raised there.

    Where no search has started helpers, the task is done here at once: a new one takes longer to
    start than most tasks.
    """
    helpers = processes.started_helpers()[0] if processes.have_helpers_started() else None
    if helpers is None:
        result = function(*arguments)
        return lambda: result
    queue = _Queue(function, [arguments], helpers, 1)
    queue.hand_out()
    return functools.cache(lambda: next(queue.results())[1])


def _workers(count: int) -> tuple[Executor | None, int]:
    """Who does so many tasks beside this process, and how many they get at once."""
    executor = _EXECUTOR.get()
    if processes.is_sharing():
        outer = _AT_WORK[-1] if _AT_WORK and executor is None else None
        return (None, 0) if outer is None else outer.helpers
    if executor is not None and count > 0:
        return executor, IN_FLIGHT
    return processes.started_helpers() if count > 1 else (None, 0)


_AT_WORK: "list[_Queue[Any]]" = []
"""Queues that this process is at work on, each within what is done meanwhile of the one before."""


class _Queue(Generic[Result]):
    """Tasks, of which helpers and this process take the next one whenever they are idle.

    An executor of the user gets them all.
    """

    def __init__(
        self,
        function: Callable[..., Result],
        tasks: Sequence[Task],
        workers: Executor | None,
        most: int,
    ):
        self._function, self._tasks, self._workers, self._most = function, tasks, workers, most
        self._helps = workers is None or workers is not _EXECUTOR.get()
        self._settings = processes.settings_of_jax()
        self._waiting, self._lost = deque(range(len(tasks))), Counter[int]()
        self._handed: dict[int, Future[Result]] = {}
        self._refused: Exception | None = None
        self._outer: _Queue[Any] | None = None  # within which all this is done meanwhile
        self._least_time = 0.0  # of a task that was done here
        self._lock = RLock()

    @property
    def helpers(self) -> tuple[Executor | None, int]:
        """Helpers that have its tasks, and how many they get at once; not an executor's workers."""
        return (self._workers, self._most) if self._helps else (None, 0)

    def hand_out(self, _: object = None) -> None:
        """Give workers what they can take; helpers get one more whenever one is done."""
        with self._lock:
            while self._waiting and self._at_workers() < self._most and self._is_worth_sharing():
                number = self._waiting.popleft()
                try:
                    self._handed[number] = self._submitted(number)
                except (RuntimeError, BrokenExecutor) as error:
                    self._give_up(error)
                    self._waiting.appendleft(number)
                    return
                if self._helps:
                    self._handed[number].add_done_callback(self.hand_out)

    def results(self) -> Iterator[tuple[int, Result]]:
        """Do what no helper has taken; number and result of each task as soon as it is done."""
        while self._is_left():
            if (number := self._next()) is not None:
                yield number, self._done_here(number)
            else:
                futures = self._futures()
                if not futures and self._refused is not None:
                    raise self._refused
                wait(futures, return_when=FIRST_COMPLETED)
            # Results are yielded before a failure in the same batch is raised.
            for number, future in sorted(self._ended(), key=lambda ended: _has_failed(ended[1])):
                yield from self._received(number, future)
            self.hand_out()

    @contextlib.contextmanager
    def at_work(self) -> Iterator[None]:
        """Leave the other cores to workers; what still waits where this process stops is left."""
        is_first = self._workers is not None and not processes.is_sharing()
        self._outer = _AT_WORK[-1] if _AT_WORK else None
        _AT_WORK.append(self)
        try:
            with processes.sharing() if is_first else contextlib.nullcontext():
                yield
        except BaseException as error:
            self._most = 0
            if self._workers is not None and self._helps:
                self._workers.shutdown(wait=False, kill_workers=True)  # type: ignore[call-arg]
            if isinstance(error, BrokenExecutor | CancelledError):
                raise WorkerError(LOST) from error
            raise
        finally:
            _AT_WORK.remove(self)
            for future in self._futures():
                future.cancel()

    def _done_here(self, number: int) -> Result:
        began = time.perf_counter()
        result = self._function(*self._tasks[number])
        took = time.perf_counter() - began
        self._least_time = min(self._least_time or took, took)
        return result

    def _is_worth_sharing(self) -> bool:
        """Whether workers are free; of what is done meanwhile, whether enough of it is left."""
        left = len(self._waiting) * self._least_time
        return self._outer is None or (left > COMPILED_IN and self._outer._is_idle())

    def _is_idle(self) -> bool:
        """Whether its workers have nothing to do, nor those of what it is within."""
        is_done = not self._waiting and self._at_workers() < self._most
        return is_done and (self._outer is None or self._outer._is_idle())

    def _submitted(self, number: int) -> Future[Result]:
        assert self._workers is not None
        if self._helps:
            return self._workers.submit(self._function, *self._tasks[number])
        packed = cloudpickle.dumps((self._function, self._tasks[number]))
        return self._workers.submit(_done_elsewhere, packed, PROCESS, self._settings)

    def _received(self, number: int, future: Future[Result]) -> Iterator[tuple[int, Result]]:
        """Result of a task; where its worker failed it is done here, or given out again."""
        if not _has_failed(future):
            yield number, future.result()
        elif self._helps:
            if _is_lost(future):
                self._give_up()
            yield number, self._function(*self._tasks[number])  # what it raises tells what is wrong
        elif _is_lost(future) and self._lost[number] < TRIES - 1:
            self._lost[number] += 1
            self._waiting.appendleft(number)
        else:
            future.result()

    def _give_up(self, error: Exception | None = None) -> None:
        """Give no more to workers that are lost; without helpers all is done here from now on."""
        self._most, self._refused = 0, error
        if self._helps:
            processes.work_alone()

    def _at_workers(self) -> int:
        return sum(not future.done() for future in self._handed.values())

    def _is_left(self) -> bool:
        with self._lock:
            return bool(self._waiting or self._handed)

    def _futures(self) -> list[Future[Result]]:
        with self._lock:
            return [*self._handed.values()]

    def _ended(self) -> list[tuple[int, Future[Result]]]:
        """Take what workers have ended, by number."""
        with self._lock:
            ended = [(number, future) for number, future in self._handed.items() if future.done()]
            for number, _ in ended:
                del self._handed[number]
            return ended

    def _next(self) -> int | None:
        """Number of a task that this process can begin: one that waits, or waits in a helper."""
        with self._lock:
            if self._waiting and self._helps:
                return self._waiting.popleft()
            handed = self._handed.items() if self._helps else ()
            number = next((number for number, future in handed if future.cancel()), None)
            if number is not None:
                del self._handed[number]
            return number


def _has_failed(future: Future[Result]) -> bool:
    return future.cancelled() or future.exception() is not None


def _is_lost(future: Future[Result]) -> bool:
    return future.cancelled() or isinstance(future.exception(), BrokenExecutor | CancelledError)


def _done_elsewhere(packed: bytes, process: str, settings: processes.Settings) -> Any:
    """Result of a part that came from another process, or from another thread of this one."""
    with _COMPUTING:
        if process != PROCESS:
            processes.prepare_to_help(settings)
        function, task = pickle.loads(packed)
        return function(*task)
