"""What is made of experiments, and stays for the few that were used last.

An experiment comes in, what was made of it goes out; what that is, is not known here.
"""

from collections.abc import Callable
from typing import Generic, TypeVar

from ..experiment.experiment import Experiment

Made = TypeVar("Made")

MOST = 12
"""Most experiments for which it stays; undo and redo among them are quick."""


class LastUsed(Generic[Made]):
    """What `make` makes of an experiment, made once while the experiment is among the last used."""

    def __init__(self, make: Callable[[Experiment], Made]):
        self._make = make
        self._kept: list[tuple[Experiment, Made]] = []

    def __call__(self, experiment: Experiment) -> Made:
        """Return what is made of an experiment, which is told by its identity."""
        known = [made for other, made in self._kept if other is experiment]
        made = known[0] if known else self._make(experiment)
        others = [kept for kept in self._kept if kept[0] is not experiment]
        self._kept = [*others, (experiment, made)][-MOST:]
        return made
