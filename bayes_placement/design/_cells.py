"""_cells: in, candidates and an estimator; out, chunks of cells, each computed by itself anywhere.

Not known here: how chunks are handed out and kept. A chunk is all that determines its result, so
that another process, or the next run, can compute it or know that it has been.
"""

import functools
import hashlib
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpyro.distributions import Distribution
from numpyro.distributions.transforms import Transform

from .._sites import is_unknown
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
        return _hash(self.estimator, self.seed, self.experiment, self.nominal, self.stacks)

    def program(self) -> str:
        """Hash of everything that is compiled: the candidates by their number and kind only."""
        leaves, structure = jax.tree.flatten(self.stacks)
        sizes = [(np.shape(leaf), np.asarray(leaf).dtype.str) for leaf in leaves]
        words = [str(structure), repr(sizes), repr(list(self.stacks))]
        return _hash(self.estimator, self.seed, words, self.experiment, self.nominal)


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

    def fingerprint(self) -> str:
        """Hash of everything that determines its result."""
        return _hash(self.task.fingerprint(), self.candidate)


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
        whole, each = task._replace(stacks=stacks), min(size, len(place))
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
    stacks = jax.tree.map(jnp.asarray, chunk.task.stacks)
    found = _compiled(_ByProgram(chunk.task))(stacks, jnp.asarray(chunk.candidate))
    return np.asarray(found)[: len(chunk.place)]


class _ByProgram:
    """A task, equal to another that is compiled alike."""

    def __init__(self, task: Task):
        self.task, self.key = task, task.program()

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


def _hash(*parts: Any) -> str:
    found = hashlib.sha256()
    for part in parts:
        leaves, structure = jax.tree.flatten(part, is_leaf=is_unknown)
        found.update(str(structure).encode())
        for leaf in leaves:
            found.update(_content(leaf))
    return found.hexdigest()


def _content(value: Any) -> bytes:
    """Content of a leaf. A law by its parameters: its leaves come in an order of their own.

    NumPyro collects the fields of a law in a set, whose order differs between processes.
    """
    if isinstance(value, tuple | list):
        return b"".join(_content(one) for one in value)
    if isinstance(value, Distribution | Transform):
        own = vars(value)
        names = sorted(set(own) & {*_parameters(value), "base_dist", "transforms"})
        return repr((type(value).__name__, names)).encode() + _content([own[n] for n in names])
    return value.encode() if isinstance(value, str) else np.asarray(value).tobytes()


def _parameters(value: Distribution | Transform) -> list[str]:
    shapes = ["_batch_shape", "_event_shape"]
    if isinstance(value, Distribution):
        return [*value.arg_constraints, *shapes]
    return [name for name in vars(value) if not name.startswith("_")]
