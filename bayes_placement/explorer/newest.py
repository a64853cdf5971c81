"""One thing after the other is looked at, of those that wait the newest alone."""

from collections.abc import Callable
from typing import Generic, TypeVar

from .._shared.errors import InputError

Wanted = TypeVar("Wanted")


class Newest(Generic[Wanted]):
    """What is to be looked at, and what is.

    Parameters
    ----------
    begin
        Called with what is to be looked at.
    """

    def __init__(self, begin: Callable[[Wanted], None]):
        self._begin = begin
        self._waiting: list[Wanted] = []
        self._looked: list[Wanted] = []

    def choose(self, wanted: Wanted) -> None:
        """Look at something once that before has been looked at."""
        self._waiting = [wanted]
        if not self._looked:
            self._look()

    def forget(self) -> None:
        """Look at nothing more."""
        self._waiting = []

    def ended(self) -> tuple[Wanted, bool]:
        """Return what was looked at, and whether nothing else was chosen meanwhile."""
        (looked,), self._looked = self._looked, []
        is_last = not self._waiting
        if self._waiting:
            self._look()
        return looked, is_last

    def _look(self) -> None:
        self._looked, self._waiting = self._waiting, []
        try:
            self._begin(*self._looked)
        except InputError:
            self._looked = []
            raise
