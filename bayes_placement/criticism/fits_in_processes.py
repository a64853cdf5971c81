"""Fits in several processes, which are kept in the folder of this one.

A function and its tasks come in, what it returns for each goes out. What is fitted is not known
here.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from threadpoolctl import threadpool_limits

from .._shared.parts import nothing, shared
from .kept_fits import count_taken, fits_kept_in, folder_of_fits

Outcome = TypeVar("Outcome")


def fitted_in_processes(
    fit: Callable[..., Outcome],
    tasks: Sequence[tuple[object, ...]],
    done: Callable[[int], None] = lambda _: None,
    meanwhile: Callable[[], object] = nothing,
) -> list[Outcome]:
    """Fit in this process and its helpers, see `shared`.

    The function is one of a module, whose results are arrays and numbers. Tasks are its arguments,
    those that take longest first; `done` is called with the number of each that is done.
    `meanwhile` is what this process does first, once helpers have begun.
    """
    folder = folder_of_fits()
    outcomes = shared(_in_folder, [(fit, folder, task) for task in tasks], done, meanwhile)
    count_taken(sum(taken for _, taken in outcomes))
    return [outcome for outcome, _ in outcomes]


@threadpool_limits.wrap(limits=1)
def _in_folder(
    fit: Callable[..., Outcome], folder: Path | None, task: tuple[object, ...]
) -> tuple[Outcome, int]:
    """What one process finds, and how many fits it takes from the folder."""
    with fits_kept_in(folder) as fits:
        outcome = fit(*task)
    return outcome, 0 if fits is None else fits.taken
