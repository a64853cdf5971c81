"""_cells: in, candidates and an estimator; out, chunks of cells, each computed by itself anywhere.

Not known here: how chunks are handed out and kept. A chunk is all that determines its result, so
that another process, or the next run, can compute it or know that it has been.
"""

import functools
import pickle
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..._types import InputError
from ...experiment.experiment import Experiment
from .._candidates import Candidates, placed
from ..information._estimator import Estimator, Plan
from ._fingerprint import fingerprint


@dataclass(frozen=True, eq=False)
class Task:
    """What all cells of one kind share.

    Parameters
    ----------
    experiment
        The experiment.
    estimator, seed
        How information is estimated.
    nominal
        Nominal values of what is not moved, by name.
    stacks
        Laws of each transducer that is moved at its candidates, and nominal values there.
    recorded
        Recorded places of the candidates [candidate, ...], by transducer; only told, not used.
    """

    experiment: Experiment
    estimator: Estimator
    seed: int
    nominal: dict[str, Any]
    stacks: dict[str, tuple[Any, dict[str, np.ndarray]]]
    recorded: dict[str, np.ndarray] = field(default_factory=dict)

    @functools.cached_property
    def content(self) -> str:
        """Hash of everything that determines a result: all numbers, laws and names."""
        return fingerprint(self.estimator, self.seed, self.experiment, self.nominal, self.stacks)

    @functools.cached_property
    def program(self) -> str:
        """Hash of everything that is compiled: the candidates by their number and kind only."""
        sizes = jax.tree.map(lambda leaf: f"{leaf.dtype} {leaf.shape}", self.stacks)
        return fingerprint(self.estimator, self.seed, self.experiment, self.nominal, sizes)

    @functools.cached_property
    def packed(self) -> bytes:
        """The task as it travels, packed once for all its chunks.

        Raises
        ------
        ValueError
            If something in it cannot travel.
        """
        try:
            return pickle.dumps([getattr(self, own.name) for own in fields(self)])
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise InputError(
                f"The experiment cannot be sent to another process: {error}. Functions and classes "
                "of your own can be, once they are defined in a file, outside of any function; "
                "or compute here: executor=None."
            ) from error


class Chunk(NamedTuple):
    """Cells of one task.

    Parameters
    ----------
    task
        What they share.
    candidate
        Candidates [cell, transducer], counted within the stacks; the last one fills them up.
    place
        Which of all cells they are [cell].
    """

    task: Task
    candidate: np.ndarray
    place: np.ndarray

    def content(self) -> str:
        """Hash of everything that determines its result."""
        return fingerprint(self.task.content, self.candidate, len(self.place))

    def sent(self) -> "Sent":
        """What travels to another process."""
        return Sent(self.task.packed, self.candidate)


class Sent(NamedTuple):
    """A chunk on its way: its task, packed, and its candidates."""

    packed: bytes
    candidate: np.ndarray


def chunks(task: Task, several: Sequence[Candidates], cells: np.ndarray, size: int) -> list[Chunk]:
    """Cells [cell, transducer] in chunks of those that differ in numbers only."""
    found = []
    kinds = np.stack([one.kinds()[own] for one, own in zip(several, cells.T, strict=True)], axis=1)
    for kind in np.unique(kinds, axis=0):
        place = np.flatnonzero((kinds == kind).all(axis=1))
        used = [np.unique(own) for own in cells[place].T]
        stacks = {one.name: one.stacked(own) for one, own in zip(several, used, strict=True)}
        pairs = zip(used, cells[place].T, strict=True)
        candidate = np.stack([np.searchsorted(own, each) for own, each in pairs], axis=1)
        recorded = {one.name: one.recorded[own] for one, own in zip(several, used, strict=True)}
        whole = replace(task, stacks=stacks, recorded=recorded)
        each = min(size, len(place))
        for first in range(0, len(place), each):
            some = candidate[first : first + each]
            # All of one size, since another one would be compiled anew.
            filled = np.concatenate([some, np.repeat(some[-1:], each - len(some), axis=0)])
            found.append(Chunk(whole, filled, place[first : first + each]))
    return found


def grid(several: Sequence[Candidates]) -> np.ndarray:
    """All combinations of candidates [cell, transducer]."""
    counts = [len(one.laws) for one in several]
    return np.stack(np.unravel_index(np.arange(np.prod(counts)), counts), axis=1)


def compute(chunk: Chunk) -> np.ndarray:
    """Information [cell, 1 + replicate] in nat, then without each replicate; anywhere the same."""
    return _information(chunk.task, chunk.candidate)[: len(chunk.place)]


def compute_sent(chunk: Sent) -> np.ndarray:
    """Return the same of a chunk that was sent, also for the cells that fill it up."""
    return _information(_opened(chunk.packed), chunk.candidate)


@functools.lru_cache(maxsize=8)
def _opened(packed: bytes) -> Task:
    try:
        return Task(*pickle.loads(packed))
    except (ImportError, AttributeError) as error:
        raise RuntimeError(
            f"A worker cannot read the experiment that it was sent: {error}. Classes of your own "
            "must be in a module that every worker can import, since only their names travel: "
            "move them to a file of their own, and start the workers where that file is found."
        ) from error


def _information(task: Task, candidate: np.ndarray) -> np.ndarray:
    stacks = jax.tree.map(jnp.asarray, task.stacks)
    return np.asarray(_compiled(_ByProgram(task))(stacks, jnp.asarray(candidate)))


class _ByProgram:
    """A task, equal to another that is compiled alike."""

    def __init__(self, task: Task):
        self.task, self.key = task, task.program

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ByProgram) and self.key == other.key


@functools.lru_cache(maxsize=8)
def _compiled(one: _ByProgram) -> Callable[[Any, Any], Any]:
    task = one.task
    plan: Plan = task.estimator.plan(task.experiment, task.seed, tuple(task.stacks))

    def cell(stacks: Any, candidate: Any) -> Any:
        laws, values = {}, dict(task.nominal)
        for name, number in zip(task.stacks, candidate, strict=True):
            laws[name], nominal = jax.tree.map(lambda leaf, i=number: leaf[i], stacks[name])
            values |= nominal
        gain = plan(placed(task.experiment, laws), values)
        return jnp.concatenate([gain.kl[None], gain.without])

    return jax.jit(lambda stacks, several: jax.lax.map(lambda one: cell(stacks, one), several))
