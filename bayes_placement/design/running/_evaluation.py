"""_evaluation: in, an experiment and an estimator; out, what is learnt at any placements asked for.

Not known here: in what order placements are tried, what is allowed.
"""

import warnings
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._types import Progress
from ...experiment.experiment import Experiment
from .._candidates import Candidates
from .._question import nominal_values
from ..information._estimator import Estimator, InformationWarning
from ..information.expected_gain import ExpectedGain
from ._cells import Task, chunks
from ._running import run


class Evaluation(NamedTuple):
    """How information is estimated, and where.

    Parameters
    ----------
    experiment
        The experiment.
    estimator, seed
        How information is estimated.
    nominal
        Nominal values of parameters that are given, by name.
    executor, store
        Where chunks are computed and kept; None for here and nowhere.
    chunk
        Cells of a chunk.
    progress
        Called with the share that is done.
    """

    experiment: Experiment
    estimator: Estimator
    seed: int
    nominal: Mapping[str, float]
    executor: Executor | None
    store: str | Path | None
    chunk: int
    progress: Progress

    def at(self, several: Sequence[Candidates], cells: np.ndarray) -> np.ndarray:
        """Information [cell, 1 + replicate] at combinations of candidates [cell, transducer].

        Minus infinity where it cannot be told: at a support, where nothing moves, the logarithm of
        the response is not finite.
        """
        names = [one.name for one in several]
        typical = self.estimator.typical()
        values = nominal_values(self.experiment, names, self.nominal, typical)
        task = Task(self.experiment, self.estimator, self.seed, values, {})
        found = np.full((len(cells), 1 + self.estimator.replicates), np.nan)
        parts = chunks(task, several, cells, self.chunk)
        with closing(run(parts, self.executor, self.store, self.progress)) as results:
            for one, result in results:
                found[one.place] = result
        found[~np.isfinite(found).all(axis=1)] = -np.inf
        _doubted(self.estimator, found[:, 0])
        return found


def _doubted(estimator: Estimator, kl: np.ndarray) -> None:
    """Warn of more information than so many draws of the parameters can tell."""
    if not isinstance(estimator, ExpectedGain):
        return
    most, greatest = np.log(estimator.draws), np.max(kl, initial=-np.inf)
    if greatest > most:
        warnings.warn(
            f"An expected gain of {greatest:.3g} nat was found with draws={estimator.draws} draws "
            f"of the parameters, which tell no more than log draws = {most:.2g} nat apart: such "
            "figures are too high, and only their order is a hint. Give more draws, "
            f"information.ExpectedGain(draws={16 * estimator.draws}), fewer lines, or a narrower "
            "prior, such as the posterior of a first measurement: after=posterior.",
            InformationWarning,
            stacklevel=4,
        )
