"""Processes of this machine that help this one: how they start, compute and end.

Two computations at once in one process take XLA twice the time of one after the other; in two
processes they do not hinder each other.
"""

import atexit
import functools
import gc
import importlib
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, suppress
from threading import Thread
from typing import TypeAlias

import jax
import loky

from .garbage import collect_garbage_rarely

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

Settings: TypeAlias = tuple[tuple[str, object], ...]
"""Their names and values."""

_sharing = False
"""Whether others are at work for this process."""

_started_before = False
"""Whether helpers have started, so that one may be idle."""

_alone = False
"""Whether this process works alone: it is a helper itself, or helpers die or do not start."""


def has_one_core() -> bool:
    """Tell whether this process is to compute on one core: the others belong to other processes."""
    return _sharing or os.environ.get("PJRT_NPROC") == ONE_THREAD["PJRT_NPROC"]


def is_sharing() -> bool:
    """Tell whether parts of its work are with other processes: what else there is is done here."""
    return _sharing


def work_alone() -> None:
    """Start no helpers from now on."""
    global _alone
    _alone = True


@contextmanager
def sharing() -> Iterator[None]:
    """Leave the other cores to those who work for this process."""
    global _sharing
    _sharing = True
    try:
        yield
    finally:
        _sharing = False


def begin_with_helpers(*modules: str) -> None:
    """Let helpers import modules while this process still reads its input, each on its own core.

    To be called before anything is computed: JAX then has one thread here too.
    """
    if loky.cpu_count() > 1:
        os.environ.setdefault("PJRT_NPROC", ONE_THREAD["PJRT_NPROC"])
        import_in_helpers(*modules)


def have_helpers_started() -> bool:
    """Whether a search has started helpers, so that one may be idle."""
    return _started_before


def import_in_helpers(*modules: str) -> None:
    """Let helpers import modules, which takes them two seconds, while this process goes on.

    Each is one file that imports what it needs: a room imports none of its files.
    """
    helpers, count = started_helpers()
    with suppress(RuntimeError):  # they are gone: what is shared later is done here
        for _ in range(count):
            assert helpers is not None
            helpers.submit(_import, modules)


def started_helpers() -> tuple[Executor | None, int]:
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


def _started(count: int) -> Executor:
    global _started_before
    helpers = pool_of(loky.get_reusable_executor, count, timeout=IDLE, env=ENVIRONMENT)
    _started_before = True
    return helpers


def pool_of(make: Callable[..., Executor], count: int, **settings: object) -> Executor:
    """Start processes that say nothing of a killed run, and that Ctrl-C does not reach."""
    # What tidies up after a killed run reads its filters when it starts.
    filters = os.environ.get("PYTHONWARNINGS"), "ignore:resource_tracker:UserWarning"
    quiet = environment({"PYTHONWARNINGS": ",".join(filter(None, filters))})
    begin = {"initializer": begin_helper, "initargs": (settings_of_jax(), os.getpid())}
    with _interrupts_held(), quiet:
        pool = make(max_workers=count, **begin, **settings)
        pool.submit(os.getpid)  # processes start with the first task
    return pool


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


def _import(modules: Sequence[str]) -> None:
    for module in modules:
        importlib.import_module(module)


def settings_of_jax() -> Settings:
    """Settings that others share who compute for this process."""
    return tuple((name, jax.config.values[name]) for name in SETTINGS)


def begin_helper(settings: Settings, parent: int) -> None:
    """Prepare a helper, which ends with the process that started it."""
    atexit.register(gc.freeze)  # or its end, which this process awaits, takes half a second
    Thread(target=_end_with, args=(parent,), daemon=True).start()
    prepare_to_help(settings)


@functools.cache
def prepare_to_help(settings: Settings) -> None:
    """Let this process work alone, compile as another one does, and say nothing."""
    work_alone()
    collect_garbage_rarely()
    warnings.simplefilter("ignore")  # the other one warns of what it sees itself
    for name, value in settings:
        jax.config.update(name, value)


def _end_with(parent: int) -> None:
    """End this helper where the process that started it was killed."""
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)
