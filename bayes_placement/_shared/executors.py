"""Worker processes on this machine, or those of a Dask cluster."""

import logging
import os
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from types import ModuleType
from typing import Any

import loky

from .arguments import arguments_checked
from .errors import InputError, MissingExtraError
from .parts import Result
from .precision import LEAST_THREADS
from .processes import ENVIRONMENT, pool_of


@arguments_checked
def workers(
    processes: int | None = None, *, dask: str | None = None
) -> AbstractContextManager[Executor | None]:
    """Executor of searches, maps and `place`, for use in a `with` statement.

    A worker that is lost is replaced, and its part is computed again: the result is the same.

    Parameters
    ----------
    processes
        Number of processes on this machine; None for this one and its helpers.
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
    """Processes on this machine, each with its share of the cores; one that is lost is replaced.

    They are spawned: a process that is forked while JAX runs hangs. They end with the process that
    started them, also if that is killed.
    """

    def __init__(self, count: int):
        self._count = count
        self._pool = self._new_pool()

    def submit(
        self, fn: Callable[..., Result], /, *args: object, **named: object
    ) -> Future[Result]:
        """Call a function in one of the processes."""
        try:
            return self._pool.submit(fn, *args, **named)
        except BrokenExecutor:
            self._pool = self._new_pool()
            return self._pool.submit(fn, *args, **named)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End all processes; parts that were not begun are left."""
        self._pool.shutdown(wait, kill_workers=cancel_futures)

    def _new_pool(self) -> Any:
        environment = ENVIRONMENT | _thread_limits(self._count)
        return pool_of(loky.ProcessPoolExecutor, self._count, env=environment)


def _thread_limits(count: int) -> dict[str, str]:
    """Environment variables by which each of `count` processes takes its share of the cores."""
    share = max(1, (os.cpu_count() or 1) // count)
    of_jax = share if share == 1 else max(share, LEAST_THREADS)
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    return {"PJRT_NPROC": str(of_jax)} | dict.fromkeys(names, str(share))


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


def _cluster(distributed: ModuleType, processes: int) -> AbstractContextManager[object]:
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
