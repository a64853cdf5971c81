"""_executors: in, a number of processes or the address of a cluster; out, where to compute.

Not known here: what is computed. Nothing heavy is imported, since each worker begins here.
"""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from types import ModuleType
from typing import Any

from ..._types import InputError, MissingExtraError

REPLACEMENTS = 3
"""How often lost workers are replaced, before something else is taken to be wrong."""


def workers(
    processes: int | None = None, *, dask: str | None = None
) -> AbstractContextManager[Executor | None]:
    """Executor for `information_map` and `place`, for use in a `with` statement.

    A lost worker loses nothing: it is replaced, and what it had in hand is computed again.

    Parameters
    ----------
    processes
        Processes on this machine; None for none but this one.
    dask
        Address of a Dask scheduler, `tcp://host:8786`; or `local`, for a scheduler and so many
        processes on this machine.

    Raises
    ------
    ValueError
        If there are less than one, or an address is given with their number.
    MissingExtraError
        If Dask is not installed.
    ConnectionError
        If no scheduler answers.
    """
    if processes is not None and processes < 1:
        raise InputError(
            f"{processes} workers were asked for; at least one is needed: workers(4), or None to "
            "compute in this process."
        )
    if dask is not None:
        return _dask(dask, processes)
    return nullcontext() if processes is None else Processes(processes)


class Processes(Executor):
    """Processes on this machine, each with its share of the cores.

    They are spawned: a process that is forked while JAX runs stands still. They end with the
    process that began them, however that ends.

    Parameters
    ----------
    count
        Processes.
    """

    def __init__(self, count: int):
        self._count, self._left = count, REPLACEMENTS
        self._pool = self._new()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Have one of them call a function."""
        return self._pool.submit(fn, *args, **kwargs)

    def renew(self) -> bool:
        """Replace them all after one was lost; False where that was done too often."""
        self._left -= 1
        if self._left < 0:
            return False
        self._pool.shutdown(cancel_futures=True)
        self._pool = self._new()
        return True

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End them."""
        self._pool.shutdown(wait, cancel_futures=cancel_futures)

    def _new(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(
            self._count,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_begin,
            initargs=(_share(self._count),),
        )


def _share(count: int) -> dict[str, str]:
    """Environment in which a process takes its share of the cores, and no more."""
    threads = str(max(1, (os.cpu_count() or 1) // count))
    names = ("PJRT_NPROC", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    return dict.fromkeys(names, threads)


def _begin(environment: dict[str, str]) -> None:
    """Begin a worker."""
    os.environ.update(environment)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that began it says when to end
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """A worker waits for work on a pipe that its siblings hold open, so that nothing tells it."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextmanager
def _dask(address: str, processes: int | None) -> Iterator[Executor]:
    if address != "local" and processes is not None:
        raise InputError(
            f"{processes} workers were asked for together with the Dask scheduler {address}, whose "
            f'workers are there already. Give its address alone, workers(dask="{address}"), or '
            f'begin some here: workers({processes}, dask="local").'
        )
    distributed = _distributed()
    with ExitStack() as several:
        if address == "local":
            where = several.enter_context(_cluster(distributed, processes or os.cpu_count() or 1))
        else:
            where = address
        try:
            # Not the default: whatever else of the caller knows Dask would begin to use it.
            client = several.enter_context(distributed.Client(where, set_as_default=False))
        except (OSError, ValueError) as error:
            raise ConnectionError(
                f"No Dask scheduler answers at {address}: {error}. Begin one with `dask scheduler`,"
                f' which tells its address; or give dask="local" to compute on this machine.'
            ) from error
        yield client.get_executor(pure=False)


def _cluster(distributed: ModuleType, processes: int) -> Any:
    """Scheduler and workers on this machine."""
    return distributed.LocalCluster(
        n_workers=processes,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",  # any port, so that several clusters can be
        memory_limit=None,  # a worker near its limit would stand still without a word
        env=_share(processes),
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
