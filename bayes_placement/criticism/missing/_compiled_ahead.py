"""Problems in their order, each compiled while those before it are fitted."""

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from ...inference.residuals import Problem

AHEAD = 2
"""Problems that are compiled while one is fitted."""


def compiled_ahead(problems: Iterable[Problem]) -> Iterator[Problem]:
    """Yield problems in their order, compiled; meanwhile the next ones are compiled."""
    waiting: deque[tuple[Problem, Future[Any]]] = deque()
    with ThreadPoolExecutor(AHEAD) as pool:
        for problem in problems:
            waiting.append((problem, pool.submit(problem.prepare)))
            if len(waiting) > AHEAD:
                yield _awaited(*waiting.popleft())
        while waiting:
            yield _awaited(*waiting.popleft())


def _awaited(problem: Problem, compilation: Future[Any]) -> Problem:
    compilation.result()
    return problem
