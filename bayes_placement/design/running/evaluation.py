"""Evaluation of the information gain at placements, and its settings, common to all searches."""

from collections.abc import Generator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple, TypeAlias

import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike

from ..._shared.dimensions import Key
from ..._shared.errors import InputError, warn
from ..._shared.parts import done_by, shared_in_any_order
from ..._shared.progress import Progress, no_progress
from ..._shared.ranges import described, reach
from ..._shared.sites import Role, Unknown
from ...experiment.content_hash import ArrayStore, content_hash
from ...experiment.experiment import Experiment
from ...experiment.variants import with_lines
from ...inference.record import integer_seed
from .._candidates import Candidates
from ..information.estimator import Estimator, InformationWarning, Values
from ..information.expected_gain import ExpectedGain
from ..information.kernel_gain import KernelGain
from .chunks import Chunk, Task, chunks, compute, compute_packed

VERSION = version("bayes_placement")
"""Part of the name of each file, since results of another version may differ."""

GAIN, JACKKNIFE = "information_gain", "information_gain_jackknife"


class Store:
    """A folder with a file for each finished chunk, made if need be; None stores nothing."""

    def __init__(self, folder: str | Path | None):
        self._files = None if folder is None else ArrayStore(folder)

    def read(self, chunk: Chunk) -> np.ndarray | None:
        """Information gain of a chunk; None if it is missing or, with a warning, damaged."""
        arrays = None if self._files is None else self._files.read(_key(chunk))
        return None if arrays is None else np.column_stack([arrays[GAIN], arrays[JACKKNIFE]])

    def write(self, chunk: Chunk, gain: np.ndarray) -> None:
        """Store the information gain of a chunk [cell, 1 + replicate]."""
        if self._files is None:
            return
        settings = np.array(str(chunk.task.settings()))
        gains = {GAIN: gain[:, 0], JACKKNIFE: gain[:, 1:]}
        self._files.write(_key(chunk), gains | {"settings": settings} | chunk.recorded())


def _key(chunk: Chunk) -> str:
    return content_hash(VERSION, chunk.content())


Computed: TypeAlias = tuple[Chunk, np.ndarray]

LEAST_SHARED = 16
"""Chunks of which this process has helpers; a helper starts in the time of five."""


def run(
    chunks: Sequence[Chunk], executor: Executor | None, store: str | Path | None, progress: Progress
) -> Generator[Computed, None, None]:
    """Results of all chunks, in any order; those in the store are read, not computed.

    Only this process writes to the store.
    """
    finished = Store(store)
    missing, done = [], 0
    for chunk in chunks:
        gain = finished.read(chunk)
        if gain is None:
            missing.append(chunk)
            continue
        done += 1
        yield chunk, gain
    progress(done / len(chunks))
    with closing(_computed(missing, executor)) as computed:
        for chunk, gain in computed:
            finished.write(chunk, gain)
            done += 1
            progress(done / len(chunks))
            yield chunk, gain


def _computed(
    chunks: Sequence[Chunk], executor: Executor | None
) -> Generator[Computed, None, None]:
    """Results of an executor, or of this process and of helpers on its other cores."""
    if executor is None and len(chunks) < LEAST_SHARED:
        yield from ((chunk, compute(chunk)) for chunk in chunks)
        return
    try:
        tasks = [(chunk.packed(),) for chunk in chunks]
    except InputError:
        if executor is not None:
            raise
        yield from ((chunk, compute(chunk)) for chunk in chunks)  # what cannot be sent
        return
    with done_by(executor):
        for number, gain in shared_in_any_order(compute_packed, tasks):
            yield chunks[number], gain[: len(chunks[number].cells)]


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


def with_parameters_of_interest(
    experiment: Experiment, about: Sequence[str] | None, nominal: Mapping[str, float] | None
) -> tuple[Experiment, dict[str, float]]:
    """Hold all parameters but those of interest at their nominal values, as Case 1 of the paper.

    Nominal values are the means of the priors by default; those of parameters that are still
    unknown are returned as well.
    """
    values = dict(nominal or {})
    _refuse_impossible(values, experiment)
    if about is None:
        return experiment, values
    typical = experiment.nominal_values()
    parameters = [unknown.name for unknown in experiment.unknowns if unknown.role is Role.PARAMETER]
    if not about or not set(about) <= set(parameters):
        raise InputError(
            f"about={list(about)} was given; names of unknown parameters are needed. Those are "
            f"{', '.join(parameters)}."
        )
    fixed = {name: values.pop(name, typical[name]) for name in parameters if name not in about}
    return experiment.fix(fixed), values


def nominal_values(
    experiment: Experiment,
    moved: Sequence[str],
    stated: Mapping[str, float],
    typical: Mapping[str, ArrayLike],
) -> Values:
    """Nominal value of each unknown but the positions of what is moved.

    Values that the user states come first, then typical ones, better than recorded positions and
    means of priors.
    """
    unknown = experiment.unknown
    return {
        name: jnp.asarray(stated.get(name, typical.get(name, value)))
        for name, value in experiment.nominal_values().items()
        if not _is_position_of(unknown[name], moved)
    }


def _is_position_of(unknown: Unknown, transducers: Sequence[str]) -> bool:
    is_position = unknown.is_placement and unknown.field == "position"
    return is_position and unknown.owner.name in transducers


def _refuse_impossible(nominal: Mapping[str, float], experiment: Experiment) -> None:
    """Refuse nominal values of what is no unknown parameter, and outside of the prior."""
    names = [unknown.name for unknown in experiment.unknowns if not unknown.is_of_transducer]
    for name in nominal:
        if name not in names:
            raise InputError(
                f"A nominal value of {name} was given, which is no unknown parameter; those are "
                f"{', '.join(names)}. The nominal positions of transducers are those recorded."
            )
    for name, value in nominal.items():
        prior = experiment.unknown[name].distribution
        low, high = reach(prior)
        if np.any(np.less(value, low)) or np.any(np.greater(value, high)):
            raise InputError(
                f"A nominal value of {value:g} was given for {name}, outside of its prior "
                f"{described(prior)}; one that the prior allows is needed, since the nominal data "
                f"are those of it. Give one from {low:.3g} to {high:.3g}."
            )
