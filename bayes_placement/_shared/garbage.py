"""Memory and threads of a process that computes: garbage, what is kept for reuse, BLAS."""

import ctypes
import gc
import mmap
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from threadpoolctl import threadpool_limits

RARELY = (100_000, 50, 50)
"""Thresholds of garbage. Traced functions are of many small objects that stay: by default Python
looks through all of them whenever a quarter more has come, a tenth of the time of a search."""

LARGEST_REUSED, KEPT_FREE = 2**25, 2**30
"""Bytes of the largest array whose memory is reused, and of what is kept for reuse. By default the
C library gives arrays back and fetches the next one page by page: a fifth of the time of some
searches."""

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
"""Numbers of these settings in the C library, see mallopt(3)."""


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


@contextmanager
def long_computation() -> Iterator[None]:
    """Seldom look for garbage, and use one thread of BLAS, while this runs; a decorator as well.

    Eigenvalues of 93 modes, many times over, take 5 ms each with one thread; more threads wait for
    each other where points are computed side by side: 300 times as long on a machine that is busy.
    """
    with rare_garbage_collection(), threadpool_limits(limits=1):
        yield


def give_memory_back() -> None:
    """Give the memory back that is kept for reuse; it takes a tenth of a second."""
    gc.collect()
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):  # another C library
            ctypes.CDLL(None).malloc_trim(0)


def memory_in_use() -> float:
    """Bytes that this process alone has in memory; 0 where the system does not say."""
    with suppress(OSError):
        resident, shared = Path("/proc/self/statm").read_text().split()[1:3]
        return float((int(resident) - int(shared)) * mmap.PAGESIZE)
    return 0.0


def _set_allocator(kept_free: int) -> None:
    """Let the C library of Linux reuse arrays, and keep so many bytes that are free."""
    if sys.platform != "linux":
        return
    with suppress(OSError, AttributeError):  # another C library
        library = ctypes.CDLL(None)
        library.mallopt(M_MMAP_THRESHOLD, LARGEST_REUSED)
        library.mallopt(M_TRIM_THRESHOLD, kept_free)
