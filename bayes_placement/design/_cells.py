"""_cells: in, candidates and an estimator; out, chunks of cells, each computed by itself anywhere.

Not known here: how chunks are handed out and kept. A chunk is all that determines its result, so
that another process, or the next run, can compute it or know that it has been.
"""

import functools
import hashlib
import itertools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..experiment import Experiment
from ..information._estimator import Estimator, Plan
from ._candidates import Candidates, placed


class Task(NamedTuple):
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
    """

    experiment: Experiment
    estimator: Estimator
    seed: int
    nominal: dict[str, Any]
    stacks: dict[str, tuple[Any, dict[str, np.ndarray]]]

    def fingerprint(self) -> str:
        """Hash of everything that determines a result: all numbers, laws and names."""
        found = hashlib.sha256(repr((self.estimator.settings(), self.seed)).encode())
        for part in (self.experiment, self.nominal, self.stacks):
            leaves, structure = jax.tree.flatten(part)
            found.update(str(structure).encode())
            for leaf in leaves:
                found.update(np.asarray(leaf).tobytes())
        return found.hexdigest()


class Chunk(NamedTuple):
    """Cells of one task.

    Parameters
    ----------
    task
        What they share.
    candidate
        Candidates [cell, transducer], counted within the stacks.
    place
        Where the results belong [cell, transducer].
    """

    task: Task
    candidate: np.ndarray
    place: np.ndarray

    def fingerprint(self) -> str:
        """Hash of everything that determines its result."""
        found = hashlib.sha256(self.task.fingerprint().encode())
        found.update(np.ascontiguousarray(self.candidate).tobytes())
        return found.hexdigest()


def chunks(task: Task, several: Sequence[Candidates], size: int) -> list[Chunk]:
    """All combinations of candidates in chunks of cells that differ in numbers only."""
    groups = [_groups(one) for one in several]
    found = []
    for combination in itertools.product(*groups):
        stacks = {one.name: one.stacked(own) for one, own in zip(several, combination, strict=True)}
        whole = task._replace(stacks=stacks)
        counts = [len(own) for own in combination]
        index = np.stack(np.unravel_index(np.arange(np.prod(counts)), counts), axis=1)
        place = np.stack([own[i] for own, i in zip(combination, index.T, strict=True)], axis=1)
        for first in range(0, len(index), size):
            some = slice(first, first + size)
            found.append(Chunk(whole, index[some], place[some]))
    return found


def _groups(one: Candidates) -> list[np.ndarray]:
    kinds = one.kinds()
    return [np.flatnonzero(kinds == kind) for kind in np.unique(kinds)]


def compute(chunk: Chunk) -> np.ndarray:
    """Information and its error [cell, 2] in nat; the same numbers wherever it runs."""
    run = _compiled(_ByContent(chunk.task))
    return np.asarray(run(jnp.asarray(chunk.candidate)))


class _ByContent:
    """A task, equal to another of the same content."""

    def __init__(self, task: Task):
        self.task, self.key = task, task.fingerprint()

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ByContent) and self.key == other.key


@functools.lru_cache(maxsize=8)
def _compiled(one: _ByContent) -> Callable[[Any], Any]:
    task = one.task
    plan: Plan = task.estimator.plan(task.experiment, task.seed)

    def cell(index: Any) -> Any:
        laws, values = {}, dict(task.nominal)
        for number, (name, (stack, nominal)) in enumerate(task.stacks.items()):
            laws[name] = jax.tree.map(lambda leaf, i=index[number]: jnp.asarray(leaf)[i], stack)
            values |= {word: jnp.asarray(each)[index[number]] for word, each in nominal.items()}
        gain = plan(placed(task.experiment, laws), values)
        return jnp.stack([gain.kl, gain.error])

    return jax.jit(lambda several: jax.lax.map(cell, several))
