"""Fits and scans that stay in a folder: a search that was ended, or another command, goes on.

A fit follows from its problem, its starts and its settings alone, and its file is named by their
hash.
"""

import pickle
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple, TypeVar

import jax
import numpy as np
from threadpoolctl import threadpool_limits

from .._shared.errors import WritingError, warn
from .._shared.parts import nothing, shared
from ..experiment.content_hash import ArrayStore, content_hash
from ..inference.engines.empirical_bayes import Rival, Sized, fitted_with_sizes
from ..inference.engines.least_squares import ParameterPoints
from ..inference.engines.levenberg_marquardt import Fit, Laplace
from ..inference.residuals import Problem

VERSION = version("bayes_placement")
"""Part of the name of each file, since fits of another version may differ."""

MOST_BYTES = 1 << 20
"""Largest tree that is kept: the scans of a large measurement would be a gigabyte."""

NO_RIVAL = Rival()

NONE = np.zeros(0)
"""An array that there is, whatever it holds."""

FIT_LAYOUT = Fit(NONE, 0.0, 0.0, Laplace(NONE, np.zeros((0, 0)), False), 0.0, 0)
"""A fit whose structure alone matters."""

Tree = TypeVar("Tree")


class KeptFits:
    """Fits in a folder, made if need be, and how many of an earlier run were taken."""

    def __init__(self, folder: str | Path):
        self.files = ArrayStore(folder)
        self.read_here = set[str]()
        self._earlier = self.files.keys()

    @property
    def folder(self) -> Path:
        """Where they are."""
        return self.files.folder

    @property
    def taken(self) -> int:
        """How many were taken that an earlier run left."""
        return len(self.read_here & self._earlier)

    def read(self, key: str, like: Tree) -> Tree | None:
        """Return a tree of arrays and numbers; None where it is not there."""
        arrays = self.files.read(key)
        if arrays is None:
            return None
        self.read_here.add(key)
        leaves = [arrays[_name(number)] for number in range(len(arrays))]
        numbers = [leaf if leaf.ndim else leaf.item() for leaf in leaves]
        return jax.tree.unflatten(jax.tree.structure(like), numbers)

    def write(self, key: str, tree: object) -> None:
        """Keep a tree that is not too large; a search does not end where that fails."""
        leaves = {_name(number): leaf for number, leaf in enumerate(jax.tree.leaves(tree))}
        if sum(np.asarray(leaf).nbytes for leaf in leaves.values()) > MOST_BYTES:
            return
        try:
            self.files.write(key, leaves)
            self._earlier.discard(key)
        except WritingError as error:
            warn(f"A fit is not kept for a later run: {error}")


_KEPT: ContextVar[KeptFits | None] = ContextVar("fits", default=None)


@contextmanager
def fits_kept_in(folder: str | Path | None) -> Iterator[KeptFits | None]:
    """Keep the fits of what follows in a folder; None changes nothing."""
    if folder is None:
        yield _KEPT.get()
        return
    fits = KeptFits(folder)
    token = _KEPT.set(fits)
    try:
        yield fits
    finally:
        _KEPT.reset(token)


def folder_of_fits() -> Path | None:
    """Folder in which fits are kept just now, from wherever it is looked at; None of none."""
    fits = _KEPT.get()
    return None if fits is None else fits.folder.absolute()


def count_read(keys: Iterable[str]) -> None:
    """Count fits that another process has read, some of which others of this run have written."""
    fits = _KEPT.get()
    if fits is not None:
        fits.read_here.update(keys)


def stored_or_computed(
    compute: Callable[[], Tree], like: Tree, problem: Problem, *inputs: object
) -> Tree:
    """Return what a file holds, or compute it and write the file.

    Results of the same inputs are told apart by a tree of the same structure. Inputs are all that
    they follow from besides the problem that is fitted.
    """
    fits = _KEPT.get()
    key = None if fits is None else _key_of_kept(like, problem, *inputs)
    if fits is None or key is None:
        return compute()
    known = fits.read(key, like)
    if known is not None:
        return known
    tree = compute()
    fits.write(key, tree)
    return tree


def is_stored(like: object, problem: Problem, *inputs: object) -> bool:
    """Whether there is a file of what follows from a problem and further inputs."""
    fits = _KEPT.get()
    key = None if fits is None else _key_of_kept(like, problem, *inputs)
    return fits is not None and key is not None and key in fits.files


def key_of(problem: Problem, *inputs: object) -> str | None:
    """Hash of a problem and further inputs, where fits are kept in a folder."""
    return None if _KEPT.get() is None else _key(*problem.content, *inputs)


def _key_of_kept(like: object, problem: Problem, *inputs: object) -> str | None:
    """Hash of inputs and of what follows: a scan and scores may follow from the same ones."""
    return _key(str(jax.tree.structure(like)), *problem.content, *inputs)


def _key(*inputs: object) -> str | None:
    """Hash of all inputs; None where one of the user's has no content that can be written."""
    try:
        return content_hash(VERSION, *inputs)
    except (pickle.PicklingError, AttributeError, TypeError):
        return None


class SizedFit(NamedTuple):
    """A fit at sizes that were found for it; see `Sized`."""

    sizes: dict[str, float]
    fit: Fit
    deviations: dict[str, float]
    as_rival: Rival


def kept_with_sizes(
    problem: Problem,
    starts: ParameterPoints,
    decreasing_errors: Sequence[float],
    rival: Rival = NO_RIVAL,
) -> Sized[Problem]:
    """Best fit with sizes of the model error, see `fitted_with_sizes`."""

    def fitted() -> SizedFit:
        sized = fitted_with_sizes(problem, starts, decreasing_errors, rival)
        return SizedFit(sized.problem.sizes, sized.fit, sized.deviations, sized.as_rival)

    deviations = {size.name: 0.0 for size in problem.unknown_sizes}
    like = SizedFit(dict.fromkeys(problem.sizes, 0.0), FIT_LAYOUT, deviations, NO_RIVAL)
    sized_fit = stored_or_computed(fitted, like, problem, starts, tuple(decreasing_errors), rival)
    return Sized(
        problem.at_sizes(sized_fit.sizes), sized_fit.fit, sized_fit.deviations, sized_fit.as_rival
    )


def _name(number: int) -> str:
    return f"leaf_{number}"


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
    count_read(key for _, keys in outcomes for key in keys)
    return [outcome for outcome, _ in outcomes]


@threadpool_limits.wrap(limits=1)
def _in_folder(
    fit: Callable[..., Outcome], folder: Path | None, task: tuple[object, ...]
) -> tuple[Outcome, Collection[str]]:
    """What one process finds, and the fits that it reads in the folder."""
    with fits_kept_in(folder) as fits:
        outcome = fit(*task)
    return outcome, () if fits is None else fits.read_here
