"""Evaluation of the information gain at placements, and its settings, common to all searches."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._shared.dimensions import Key
from ..._shared.errors import warn
from ..._shared.progress import Progress, no_progress
from ...experiment.experiment import Experiment
from ...experiment.variants import with_lines
from ...inference.random_keys import integer_seed
from .._candidates import Candidates
from .._parameters_of_interest import nominal_values, with_parameters_of_interest
from ..information.estimator import Estimator, InformationWarning
from ..information.expected_gain import ExpectedGain
from ..information.kernel_gain import KernelGain
from ._dispatch import run
from .chunks import Task, chunks

MOST_LINES = 20
"""Frequency lines that are used, where no other number is asked for."""

CHUNK = 100
"""Placements of a chunk: about a second of work in the paper's sizes, far above its overhead."""


class Evaluation(NamedTuple):
    """Settings of the estimate of the information gain and of its computation."""

    experiment: Experiment
    """The experiment."""
    estimator: Estimator
    seed: int
    """Estimator of the information gain, and its seed."""
    nominal: Mapping[str, float]
    """Nominal values of parameters that the user gives, by name."""
    executor: Executor | None
    store: str | Path | None
    """Executor of the chunks, None for this process; folder for finished chunks, None for none."""
    chunk: int
    """Placements of a chunk."""
    progress: Progress
    """Called with the share that is done."""

    @classmethod
    def of(
        cls,
        experiment: Experiment,
        *,
        estimator: Estimator | None = None,
        about: Sequence[str] | None = None,
        nominal: Mapping[str, float] | None = None,
        key: int | Key = 0,
        lines: int | None = None,
        executor: Executor | None = None,
        store: str | Path | None = None,
        chunk: int = CHUNK,
        progress: Progress = no_progress,
    ) -> "Evaluation":
        """Settings with their defaults, as described in `information_map`."""
        thinned = experiment if lines is None else with_lines(experiment, lines)
        of_interest, stated = with_parameters_of_interest(thinned, about, nominal)
        used = KernelGain() if estimator is None else estimator
        return cls(of_interest, used, integer_seed(key), stated, executor, store, chunk, progress)

    def at(self, moved: Sequence[Candidates], cells: np.ndarray) -> np.ndarray:
        """Information gain [cell, 1 + replicate] [nat] at placements.

        Minus infinity where it is not finite: at a support that does not move the logarithm of the
        response is infinite. Cells are numbers of the candidates of each transducer that is moved
        [cell, transducer].
        """
        names = [transducer.name for transducer in moved]
        values = nominal_values(self.experiment, names, self.nominal, self.estimator.typical())
        task = Task(self.experiment, self.estimator, self.seed, values)
        gain = np.full((len(cells), 1 + self.estimator.replicates), np.nan)
        batches = chunks(task, moved, cells, self.chunk)
        with closing(run(batches, self.executor, self.store, self.progress)) as results:
            for chunk, result in results:
                gain[chunk.cells] = result
        gain[~np.isfinite(gain).all(axis=1)] = -np.inf
        _warn_if_saturated(self.estimator, gain[:, 0])
        return gain

    def part(self, number: int, count: int) -> "Evaluation":
        """Return the evaluation whose progress is one of `count` equal parts of this one's."""
        return self._replace(progress=part_of_progress(self.progress, number, count))


def words_on_lines(declared: Experiment, used: Experiment) -> str:
    """Say how many frequency lines are used; nothing where all are."""
    counts = np.size(used.frequency), np.size(declared.frequency)
    if counts[0] == counts[1]:
        return ""
    return f"{counts[0]} of {counts[1]} lines are used, evenly over the band."


def part_of_progress(progress: Progress, number: int, count: int) -> Progress:
    """Progress of one of `count` equal parts, as a share of all of them."""
    return lambda share: progress((number + share) / count)


def _warn_if_saturated(estimator: Estimator, gain: np.ndarray) -> None:
    """Warn of an expected gain above the logarithm of the number of draws, its upper limit."""
    if not isinstance(estimator, ExpectedGain):
        return
    limit, greatest = np.log(estimator.draws), np.max(gain, initial=-np.inf)
    if greatest > limit:
        warn(
            f"An expected gain of {greatest:.3g} nat was estimated with draws={estimator.draws} "
            f"draws of the parameters, which can resolve at most log draws = {limit:.2g} nat: "
            "such values are too high, and only their order is a hint. Give more draws, "
            f"information.ExpectedGain(draws={16 * estimator.draws}), fewer lines, or a narrower "
            "prior, such as the posterior of a first measurement: after=posterior.",
            InformationWarning,
        )
