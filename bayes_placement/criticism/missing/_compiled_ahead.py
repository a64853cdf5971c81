"""Problems in their order, each compiled while those before it are fitted."""

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import copy_context
from functools import partial
from typing import Protocol, TypeVar, runtime_checkable

AHEAD = 2
"""Problems that are compiled while one is fitted."""


@runtime_checkable
class Preparable(Protocol):
    """A problem, or work on one."""

    def prepare(self) -> None:
        """Compile what it needs."""


Work = TypeVar("Work", bound=Preparable)


def compiled_ahead(problems: Iterable[Work]) -> Iterator[Work]:
    """Yield problems in their order, compiled; meanwhile the next ones are compiled."""
    waiting: deque[tuple[Work, Future[None]]] = deque()
    with ThreadPoolExecutor(AHEAD) as pool:
        for problem in problems:
            # A thread has no context of its own, and so no folder of fits.
            prepare = partial(copy_context().run, problem.prepare)
            waiting.append((problem, pool.submit(prepare)))
            if len(waiting) > AHEAD:
                yield _awaited(*waiting.popleft())
        while waiting:
            yield _awaited(*waiting.popleft())


def _awaited(problem: Work, compilation: Future[None]) -> Work:
    compilation.result()
    return problem
