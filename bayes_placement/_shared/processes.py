"""Tasks shared among processes of this machine.

Two computations at once in one process take XLA twice the time of one after the other; in two
processes they do not hinder each other.
"""

import atexit
import ctypes
import gc
import importlib
import os
import signal
import sys
import time
import warnings
from collections import deque
from collections.abc import Callable, Container, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future
from contextlib import AbstractContextManager, contextmanager, suppress
from threading import RLock, Thread
from typing import Any, Generic, TypeVar

import jax
import loky

Result = TypeVar("Result")
Task = tuple[Any, ...]

MOST = 4
"""Most processes, this one included: each takes up to a gigabyte."""

IDLE = 20
"""Time [s] after which a helper without a task ends."""

ONE_THREAD = {name: "1" for name in ("PJRT_NPROC", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
ENVIRONMENT = ONE_THREAD | {"LOKY_MAX_MEMORY_LEAK_SIZE": "1e12"}
"""Of a helper. Compiled functions that it keeps are no leak, for which it would be replaced."""

NOT_STARTED = (OSError, ImportError, RuntimeError, AssertionError)
"""Raised where helpers cannot start: no semaphores, no space, a process that may have no others."""

SETTINGS = (
    "jax_compilation_cache_dir",
    "jax_persistent_cache_min_compile_time_secs",
    "jax_persistent_cache_min_entry_size_bytes",
)
"""Settings of JAX that a helper shares with this process."""

RARELY = (100_000, 50, 50)
"""Thresholds of garbage. Traced functions are of many small objects that stay: by default Python
looks through all of them whenever a quarter more has come, a tenth of the time of a search."""

LARGEST_REUSED, KEPT_FREE = 2**25, 2**30
"""Bytes of the largest array whose memory is reused, and of what is kept for reuse. By default the
C library gives arrays back and fetches the next one page by page: a fifth of the time of some
searches."""

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
"""Numbers of these settings in the C library, see mallopt(3)."""

_sharing = False
"""Whether helpers are at work for this process."""

_started_before = False
"""Whether helpers have started, so that one may be idle."""

_alone = False
"""Whether this process works alone: it is a helper itself, or helpers die or do not start."""


def nothing() -> None:
    """Do nothing."""


def shared(
    function: Callable[..., Result],
    tasks: Sequence[Task],
    done: Callable[[int], None],
    meanwhile: Callable[[], Any] = nothing,
) -> list[Result]:
    """Call a function with the arguments of each task, in this process and its helpers.

    Helpers are as many as there are further cores, at most three; LOKY_MAX_CPU_COUNT=1 in the
    environment lets a search run in one process. A task that a helper cannot do is done here: what
    it raises is raised here. Results follow from the arguments alone. Tasks that take longest come
    first; each that is done is told by its number. What this process does meanwhile it does first,
    once helpers have begun.
    """
    results: dict[int, Result] = {}
    for number, result in shared_in_any_order(function, tasks, meanwhile):
        results[number] = result
        done(number)
    return [results[number] for number in range(len(tasks))]


def shared_in_any_order(
    function: Callable[..., Result],
    tasks: Sequence[Task],
    meanwhile: Callable[[], Any] = nothing,
) -> Iterator[tuple[int, Result]]:
    """Number and result of each task as soon as it is done; all else is as in `shared`."""
    helpers, count = started_helpers() if len(tasks) > 1 else (None, 0)
    queue = _Queue(function, tasks)
    with _at_work(helpers):
        for _ in range(count):
            queue.hand_to(helpers)
        meanwhile()
        yield from queue.results()


def begun_in_helper(function: Callable[..., Result], *arguments: Any) -> Callable[[], Result]:
    """Begin a task in a helper, and return what awaits its result; what it raises is raised there.

    Where no search has started helpers, the task is done here at once: a new one takes longer to
    start than most tasks.
    """
    helpers = started_helpers()[0] if _started_before else None
    if helpers is None:
        result = function(*arguments)
        return lambda: result
    queue = _Queue(function, [arguments])
    queue.hand_to(helpers)
    return lambda: next(queue.results())[1]


def collect_garbage_rarely() -> None:
    """Look for garbage seldom and reuse freed memory, in a process of this package alone."""
    gc.set_threshold(*RARELY)
    _set_allocator(KEPT_FREE)


@contextmanager
def rare_garbage_collection() -> Iterator[None]:
    """Look for garbage seldom and reuse freed memory while this runs; a decorator as well."""
    before = gc.get_threshold()
    collect_garbage_rarely()
    try:
        yield
    finally:
        gc.set_threshold(*before)
        if before != RARELY:  # not within another one, nor in a process of this package alone
            _set_allocator(2 * LARGEST_REUSED)


def _set_allocator(kept_free: int) -> None:
    """Let the C library of Linux reuse arrays, and keep so many bytes that are free."""
    if sys.platform != "linux":
        return
    with suppress(OSError, AttributeError):  # another C library
        library = ctypes.CDLL(None)
        library.mallopt(M_MMAP_THRESHOLD, LARGEST_REUSED)
        library.mallopt(M_TRIM_THRESHOLD, kept_free)


def has_one_core() -> bool:
    """Tell whether this process is to compute on one core: the others belong to other processes."""
    return _sharing or os.environ.get("PJRT_NPROC") == ONE_THREAD["PJRT_NPROC"]


@contextmanager
def _at_work(helpers: Any) -> Iterator[None]:
    """Leave the other cores to helpers; end these where this process stops in the middle."""
    global _sharing
    _sharing = helpers is not None
    try:
        yield
    except BaseException:
        if helpers is not None:
            helpers.shutdown(wait=False, kill_workers=True)
        raise
    finally:
        _sharing = False


def begin_with_helpers(module: str) -> None:
    """Let helpers import a module while this process still reads its input, each on its own core.

    To be called before anything is computed: JAX then has one thread here too.
    """
    if loky.cpu_count() > 1:
        os.environ.setdefault("PJRT_NPROC", ONE_THREAD["PJRT_NPROC"])
        import_in_helpers(module)


def import_in_helpers(module: str) -> None:
    """Let helpers import a module, which takes them two seconds, while this process goes on."""
    helpers, count = started_helpers()
    with suppress(RuntimeError):  # they are gone: what is shared later is done here
        for _ in range(count):
            helpers.submit(_import, module)


def started_helpers() -> tuple[Any, int]:
    """Return the helpers, which start at the first call, and their number; None and 0 of none.

    A GPU is not shared: it has threads of its own, and its memory belongs to one process.
    """
    global _alone
    count = min(MOST, loky.cpu_count()) - 1
    if _alone or count < 1 or jax.default_backend() != "cpu":
        return None, 0
    try:
        return _started(count), count
    except NOT_STARTED:
        _alone = True
        return None, 0


def _started(count: int) -> Any:
    global _started_before
    settings = {name: jax.config.values[name] for name in SETTINGS}
    with _interrupts_held(), _quiet_trackers():
        helpers = loky.get_reusable_executor(
            max_workers=count,
            timeout=IDLE,
            initializer=_begin,
            initargs=(settings, os.getpid()),
            env=ENVIRONMENT,
        )
        helpers.submit(os.getpid)  # processes start with the first task
    _started_before = True
    return helpers


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Start processes that Ctrl-C does not reach: this one ends them, and says so in one line."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _quiet_trackers() -> AbstractContextManager[None]:
    """Let what tidies up after a killed run say nothing; it reads its filters when it starts."""
    filters = os.environ.get("PYTHONWARNINGS"), "ignore:resource_tracker:UserWarning"
    return environment({"PYTHONWARNINGS": ",".join(filter(None, filters))})


@contextmanager
def environment(variables: dict[str, str]) -> Iterator[None]:
    """Environment that processes inherit which are started meanwhile."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _import(module: str) -> None:
    importlib.import_module(module)


def _begin(settings: dict[str, Any], parent: int) -> None:
    """Prepare a helper: it works alone, compiles as this process does, and says nothing."""
    global _alone
    _alone = True
    atexit.register(gc.freeze)  # or its end, which this process awaits, takes half a second
    Thread(target=_end_with, args=(parent,), daemon=True).start()
    collect_garbage_rarely()
    warnings.simplefilter("ignore")  # this process warns of what it sees itself
    for name, value in settings.items():
        jax.config.update(name, value)


def _end_with(parent: int) -> None:
    """End this helper where the process that started it was killed."""
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


class _Queue(Generic[Result]):
    """Tasks of which helpers and this process take the next one whenever they are idle."""

    def __init__(self, function: Callable[..., Result], tasks: Sequence[Task]):
        self._function, self._tasks = function, tasks
        self._waiting = deque(range(len(tasks)))
        self._handed: dict[int, Future[Any] | None] = {}
        self._lock = RLock()

    def hand_to(self, helpers: Any) -> None:
        """Give helpers the next task, and one more whenever it is done."""
        with self._lock:
            if not self._waiting:
                return
            number = self._waiting.popleft()
            try:
                future = helpers.submit(self._function, *self._tasks[number])
            except (RuntimeError, BrokenExecutor):  # they are gone
                self._handed[number] = None
                return
            self._handed[number] = future
        future.add_done_callback(lambda _: self.hand_to(helpers))

    def results(self) -> Iterator[tuple[int, Result]]:
        """Do what no helper has taken; number and result of each task as soon as it is done."""
        known: set[int] = set()
        while (number := self._next()) is not None:
            known.add(number)
            yield number, self._function(*self._tasks[number])
            for ended in self._ended(known):
                known.add(ended)
                yield ended, self._awaited(ended)
        for handed in self._handed:
            if handed not in known:
                yield handed, self._awaited(handed)

    def _ended(self, known: Container[int]) -> list[int]:
        """Tasks that helpers have done, less those that are known."""
        with self._lock:
            handed = dict(self._handed)
        return [n for n, future in handed.items() if n not in known and future and future.done()]

    def _next(self) -> int | None:
        with self._lock:
            return self._waiting.popleft() if self._waiting else None

    def _awaited(self, number: int) -> Result:
        """Result of a helper, or of the same task done here where the helper has failed."""
        global _alone
        future = self._handed[number]
        try:
            if future is None:
                raise BrokenExecutor
            result: Result = future.result()
        except Exception as error:  # noqa: BLE001  what it raises here tells what is wrong
            _alone = _alone or isinstance(error, BrokenExecutor)
            return self._function(*self._tasks[number])
        return result
