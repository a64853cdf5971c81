"""Chunks of placements, each with all inputs of its information gain.

So another process can compute a chunk, and a later run recognises a chunk that is finished.
"""

import functools
import pickle
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._shared.arguments import arguments_checked
from ..._shared.compiled import compiled
from ..._shared.errors import InputError, WorkerError
from ..._shared.progress import Progress, progress_bars, progress_console
from ...experiment.content_hash import content_hash
from ...experiment.experiment import Experiment
from .._candidates import Candidates, Stack, placed
from ..information.estimator import Estimator, Plan, Values


@dataclass(frozen=True, eq=False)
class Task:
    """Common inputs of some placements. Equal tasks share the plan of their estimator."""

    experiment: Experiment
    """The experiment; the positions of the transducers that are moved are None."""
    estimator: Estimator
    seed: int
    """Estimator of the information gain, and its seed."""
    nominal: Values
    """Nominal values of all unknowns but the positions of what is moved, by name."""
    stacks: dict[str, Stack] = field(default_factory=dict)
    """For each transducer that is moved, its position distributions at all candidates, and its
    nominal position there, each number an array over the candidates."""
    recorded: dict[str, np.ndarray] = field(default_factory=dict)
    """Recorded positions of the candidates [candidate, ...] [m]; results do not depend on them."""

    @functools.cached_property
    def content(self) -> str:
        """Hash of all inputs of the results."""
        return content_hash(self.estimator, self.seed, self.experiment, self.nominal, self.stacks)

    @functools.cached_property
    def planned(self) -> str:
        """Hash of all inputs of the plan: of the candidates only their form."""
        forms = jax.tree.map(lambda leaf: f"{leaf.dtype} {leaf.shape[1:]}", self.stacks)
        return content_hash(self.estimator, self.seed, self.experiment, forms)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Task) and self.planned == other.planned

    def __hash__(self) -> int:
        return hash(self.planned)

    @functools.cached_property
    def packed(self) -> bytes:
        """The pickled task, once for all its chunks."""
        try:
            return pickle.dumps([getattr(self, attribute.name) for attribute in fields(self)])
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise InputError(
                f"The experiment cannot be sent to another process: {error}. Functions and classes "
                "of your own can be if they are defined in a file, outside of any function; or "
                "compute in this process: executor=None."
            ) from error

    def settings(self) -> dict[str, int | float | str]:
        """Settings of the estimator, and the key."""
        return self.estimator.settings() | {"key": self.seed}


class Chunk(NamedTuple):
    """Some placements of a task."""

    task: Task
    """Their common inputs."""
    candidates: np.ndarray
    """Candidate of each transducer [row, transducer]; the last row is repeated so that all chunks
    of a task have one size."""
    cells: np.ndarray
    """Numbers of the placements among all that were requested [cell]."""

    def content(self) -> str:
        """Hash of all inputs of its result."""
        return content_hash(self.task.content, self.candidates, len(self.cells))

    def recorded(self) -> dict[str, np.ndarray]:
        """Recorded positions of each transducer that is moved [cell, ...] [m]."""
        columns = self.candidates[: len(self.cells)].T
        pairs = zip(self.task.recorded.items(), columns, strict=True)
        return {f"recorded.{name}": positions[column] for (name, positions), column in pairs}

    def packed(self) -> "PackedChunk":
        """The chunk in the form in which it is sent to another process."""
        return PackedChunk(self.task.packed, self.candidates)


class PackedChunk(NamedTuple):
    """A chunk as it is sent to another process: its pickled task, and its candidates."""

    task: bytes
    candidates: np.ndarray


def chunks(task: Task, moved: Sequence[Candidates], cells: np.ndarray, size: int) -> list[Chunk]:
    """Split placements into chunks; chunks of one task differ only in values.

    Cells are numbers of the candidates of each transducer that is moved [cell, transducer].
    """
    experiment = placed(task.experiment, {transducer.name: None for transducer in moved})
    columns = zip(moved, cells.T, strict=True)
    forms = np.stack([transducer.forms()[column] for transducer, column in columns], axis=1)
    result = []
    for form in np.unique(forms, axis=0):
        rows = np.flatnonzero((forms == form).all(axis=1))
        used = [np.unique(column) for column in cells[rows].T]
        numbered = [
            np.searchsorted(numbers, column)
            for numbers, column in zip(used, cells[rows].T, strict=True)
        ]
        form_task = replace(
            task,
            experiment=experiment,
            stacks={
                transducer.name: transducer.stacked(n)
                for transducer, n in zip(moved, used, strict=True)
            },
            recorded={
                transducer.name: transducer.recorded[n]
                for transducer, n in zip(moved, used, strict=True)
            },
        )
        result += _split(form_task, np.stack(numbered, axis=1), rows, min(size, len(rows)))
    return result


def _split(task: Task, candidates: np.ndarray, cells: np.ndarray, size: int) -> list[Chunk]:
    """Chunks of equal size, since another size would be compiled again."""
    result = []
    for first in range(0, len(cells), size):
        rows = candidates[first : first + size]
        padded = np.concatenate([rows, np.repeat(rows[-1:], size - len(rows), axis=0)])
        result.append(Chunk(task, padded, cells[first : first + size]))
    return result


def compute(chunk: Chunk) -> np.ndarray:
    """Information gain [cell, 1 + replicate] [nat]: the estimate, then without each replicate."""
    return _information_gain(chunk.task, chunk.candidates)[: len(chunk.cells)]


def compute_packed(chunk: PackedChunk) -> np.ndarray:
    """Information gain of a chunk that was sent, with the repeated rows [row, 1 + replicate]."""
    return _information_gain(_unpacked(chunk.task), chunk.candidates)


@functools.lru_cache(maxsize=8)
def _unpacked(packed: bytes) -> Task:
    try:
        return Task(*pickle.loads(packed))
    except (ImportError, AttributeError) as error:
        raise WorkerError(
            f"A worker cannot read the experiment that it was sent: {error}. Classes of your own "
            "must be in a module that every worker can import, since only their names are sent: "
            "move them to a file of their own, and start the workers where that file is found."
        ) from error


def _information_gain(task: Task, candidates: np.ndarray) -> np.ndarray:
    # JAX sorts the names in other dictionaries; the columns of candidates are in this order.
    stacks = OrderedDict(task.stacks)
    inputs = (_plan(task), task.experiment, task.nominal, stacks, candidates)
    return np.asarray(compiled(_gains).bound(*inputs, is_long=True)())


@functools.lru_cache(maxsize=8)
def _plan(task: Task) -> Plan:
    """Plan of all tasks that are equal to this one."""
    first = {name: _candidate(stack, 0)[0] for name, stack in task.stacks.items()}
    return task.estimator.plan(placed(task.experiment, first), task.seed, tuple(task.stacks))


def _gains(
    plan: Plan,
    experiment: Experiment,
    nominal: Values,
    stacks: OrderedDict[str, Stack],
    candidates: Int[Array, "row transducer"],
) -> Float[Array, "row estimate"]:
    """Information gain at rows of candidates."""

    def at(row: Int[Array, "transducer"]) -> Float[Array, "estimate"]:
        positions, values = {}, dict(nominal)
        for (name, stack), number in zip(stacks.items(), row, strict=True):
            positions[name], of_candidate = _candidate(stack, number)
            values |= of_candidate
        gain = plan(placed(experiment, positions), values)
        return jnp.concatenate([gain.estimate[None], gain.jackknife])

    return jax.lax.map(at, jnp.asarray(candidates))


def _candidate(stack: Stack, number: int | Int[Array, ""]) -> Stack:
    """Position distributions and nominal position of one candidate."""
    return jax.tree.map(lambda leaf: leaf[number], stack)


@arguments_checked
@contextmanager
def progress_bar(task: str = "computed") -> Iterator[Progress]:
    """Show a bar with the time left; a context manager, for `progress=` of any function.

    Parameters
    ----------
    task
        Text before the bar.

    Examples
    --------
    >>> with bp.design.progress_bar("places") as progress:
    ...     learnt = bp.information_map(experiment, places, estimator=estimator, progress=progress)
    """
    with progress_bars(progress_console(), [task]) as begin:
        yield begin(task)
