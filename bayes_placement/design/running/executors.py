"""Worker processes on this machine, or those of a Dask cluster."""

import logging
import multiprocessing
import os
import signal
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from types import ModuleType
from typing import Any

from ..._shared.arguments import arguments_checked
from ..._shared.errors import InputError, MissingExtraError
from ..._shared.precision import LEAST_THREADS
from ..._shared.processes import environment

REPLACEMENTS = 3
"""How often lost workers are replaced before the run is given up."""


@arguments_checked
def workers(
    processes: int | None = None, *, dask: str | None = None
) -> AbstractContextManager[Executor | None]:
    """Executor for `information_map` and `place`, for use in a `with` statement.

    A worker that is lost is replaced, and its chunk is computed again.

    Parameters
    ----------
    processes
        Number of processes on this machine; None to compute in this one.
    dask
        Address of a Dask scheduler, `tcp://host:8786`; or `local`, for a scheduler and `processes`
        workers on this machine.

    Raises
    ------
    InputError
        If there is less than one process, or an address is given with their number.
    MissingExtraError
        If Dask is not installed.
    ConnectionError
        If no scheduler answers.

    Examples
    --------
    >>> with bp.design.workers() as executor:  # workers(8) for eight processes
    ...     learnt = bp.information_map(experiment, places, estimator=estimator, executor=executor)
    """
    if processes is not None and processes < 1:
        raise InputError(
            f"{processes} workers were asked for; at least one is needed: workers(4), or None to "
            "compute in this process."
        )
    if dask == "":
        raise InputError(
            "dask='' was given; the address of a scheduler is needed, or \"local\" for one on this "
            'machine: workers(dask="tcp://host:8786"), workers(4, dask="local").'
        )
    if dask is not None:
        return _dask(dask, processes)
    return nullcontext() if processes is None else WorkerProcesses(processes)


class WorkerProcesses(Executor):
    """Processes on this machine, each with its share of the cores.

    They are spawned: a process that is forked while JAX runs hangs. They end with the process that
    started them, also if that is killed.

    Parameters
    ----------
    count
        Number of processes.
    """

    def __init__(self, count: int):
        self._count, self._replacements_left = count, REPLACEMENTS
        self._pool = self._new_pool()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call a function in one of the processes."""
        return self._pool.submit(fn, *args, **kwargs)

    def replace(self) -> bool:
        """Replace all processes after one was lost; False if that was done too often."""
        if self._replacements_left == 0:
            return False
        self._replacements_left -= 1
        self._pool.shutdown(cancel_futures=True)
        self._pool = self._new_pool()
        return True

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End all processes."""
        self._pool.shutdown(wait, cancel_futures=cancel_futures)

    def _new_pool(self) -> ProcessPoolExecutor:
        pool = ProcessPoolExecutor(
            self._count,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_start_worker,
            initargs=(_warning_filters(),),
        )
        # Libraries read their number of threads when they are imported, before any initializer.
        # Each submission starts one process, as long as none is idle: they take long to start.
        with environment(_thread_limits(self._count)):
            for _ in range(self._count):
                pool.submit(os.getpid)
        return pool


def _thread_limits(count: int) -> dict[str, str]:
    """Environment variables by which each of `count` processes takes its share of the cores."""
    share = max(1, (os.cpu_count() or 1) // count)
    of_jax = share if share == 1 else max(share, LEAST_THREADS)
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    return {"PJRT_NPROC": str(of_jax)} | dict.fromkeys(names, str(share))


def _warning_filters() -> list[Any]:
    """Filters of warnings of this process, without those of classes that must be imported first."""
    return [
        (action, _pattern(message), category, _pattern(module), line)
        for action, message, category, module, line in warnings.filters
        if category.__module__ == "builtins"
    ]


def _pattern(text: Any) -> str:
    """Regular expression of a filter, which keeps it compiled, as a string, or as None."""
    return getattr(text, "pattern", text) or ""


def _start_worker(filters: list[Any]) -> None:
    _filter_warnings(filters)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends it
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _filter_warnings(filters: list[Any]) -> None:
    """Treat warnings in this worker as they are treated in the process that started it."""
    warnings.resetwarnings()
    for settings in reversed(filters):  # the last one that is set comes first
        warnings.filterwarnings(*settings)


def _end_with_parent() -> None:
    """End this worker with its parent: the pipe it reads is held open by the other workers."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextmanager
def _dask(address: str, processes: int | None) -> Iterator[Executor]:
    if address != "local" and processes is not None:
        raise InputError(
            f"{processes} workers were asked for together with the Dask scheduler {address}, which "
            f'has its own workers. Give its address alone, workers(dask="{address}"), or start '
            f'workers on this machine: workers({processes}, dask="local").'
        )
    distributed = _distributed()
    with ExitStack() as stack:
        stack.enter_context(_without_tracebacks("distributed.client"))
        if address == "local":
            where = stack.enter_context(_cluster(distributed, processes or os.cpu_count() or 1))
        else:
            where = address
        try:
            # Not the default client: other Dask code of the caller would start to use it.
            client = stack.enter_context(distributed.Client(where, set_as_default=False))
        except (OSError, ValueError) as error:
            raise ConnectionError(
                f"No Dask scheduler answers at {address}: {error}. Start one with `dask scheduler`,"
                f' which prints its address; or give dask="local" to compute on this machine.'
            ) from error
        yield client.get_executor(pure=False)


@contextmanager
def _without_tracebacks(name: str) -> Iterator[None]:
    """Keep a logger from writing tracebacks of what arrives here as an error: a lost scheduler."""
    logger = logging.getLogger(name)
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)


def _cluster(distributed: ModuleType, processes: int) -> Any:
    """Scheduler and workers on this machine."""
    return distributed.LocalCluster(
        n_workers=processes,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",  # any free port
        memory_limit=None,  # a worker near its limit would pause silently
        env=_thread_limits(processes),
    )


def _distributed() -> ModuleType:
    try:
        import distributed
    except ImportError as error:
        raise MissingExtraError(
            "Dask was asked for and is not installed. Computing on a cluster needs it: "
            'pip install "bayes_placement[dask]".'
        ) from error
    return distributed
