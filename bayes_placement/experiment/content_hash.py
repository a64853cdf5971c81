"""Hash of the content of experiments and estimators, and a store of what was computed of them.

The hash is the same in every process. `joblib.hash` does not serve: it sorts the items of ordered
dictionaries, so that two experiments whose sensors stand in another order have one hash; it takes
classes by their name, so that an edited effect of the user has the hash of the old one; and it
hashes values that objects cache.
"""

import dataclasses
import functools
import hashlib
import inspect
import io
import pickle
import tempfile
import weakref
import zipfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np
from numpyro.distributions import Distribution
from numpyro.distributions.constraints import Constraint
from numpyro.distributions.transforms import Transform

from .._shared.errors import InputError, warn
from .._shared.files import write_atomically

VERSIONED = ("bayes_placement", "numpyro", "jax", "numpy", "builtins")
"""Packages whose code is identified by their version and not by its text."""

LARGE = 1 << 16
"""Size [byte] from which the hash of an array is kept as long as the array is."""

Content = tuple[str, str, tuple[int, ...], str]
"""Kind, type, shape and hash of the numbers of an array."""

_KEPT: dict[int, tuple[weakref.ref[jax.Array], Content]] = {}


def content_hash(*values: object) -> str:
    """SHA-256 of numbers, strings, distributions and modules, with all of their content."""
    digest = _Digest()
    _ContentPickler(digest).dump(values)
    return digest.sha256.hexdigest()


class _Digest:
    """A file that keeps nothing but the hash of what is written: matrices may be large."""

    def __init__(self) -> None:
        self.sha256 = hashlib.sha256()

    def write(self, content: bytes | bytearray | memoryview) -> int:
        """Take the next bytes."""
        self.sha256.update(content)
        return memoryview(content).nbytes


class _ContentPickler(pickle.Pickler):
    """Writes content only: neither shared references nor cached values."""

    def __init__(self, stream: _Digest):
        pickle.Pickler.__init__(self, stream, protocol=5)
        self.fast = True  # each object in full at every occurrence

    def persistent_id(self, value: object) -> object:
        """Content of values that pickle does not write by content; None for all others."""
        kind = type(value)
        if isinstance(value, jax.Array | np.ndarray) and value.dtype != object:
            return _content(value)
        if isinstance(value, set | frozenset):
            return kind, sorted(map(content_hash, value))
        if isinstance(value, Distribution):
            # NumPyro collects the names of its fields in sets, in no order.
            names = {*value.gather_pytree_data_fields(), *value.gather_pytree_aux_fields()}
            return kind, _fields(value, sorted(names))
        if isinstance(value, Transform | Constraint):
            return kind, value.tree_flatten()
        if isinstance(value, type) or inspect.isroutine(value):
            return value.__module__, value.__qualname__, _source(value)
        if dataclasses.is_dataclass(value):
            return kind, _fields(value, [field.name for field in dataclasses.fields(value)])
        return None


def _content(array: np.ndarray | jax.Array) -> Content:
    """Content of an array; that of a large one of JAX is kept, since nobody can change it.

    The matrices of a finite element model are part of every fit.
    """
    if isinstance(array, np.ndarray) or array.nbytes < LARGE:
        return _numbers(np.asarray(array))
    place = id(array)
    if place not in _KEPT:
        # Forgotten with the array: another one may come to lie in its place.
        reference = weakref.ref(array, lambda _: _KEPT.pop(place, None))
        _KEPT[place] = reference, _numbers(np.asarray(array))
    return _KEPT[place][1]


def _numbers(array: np.ndarray) -> Content:
    """Numbers of an array in the order of its axes: in memory they may lie in another order."""
    in_order = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
    digest = hashlib.sha256(in_order.data).hexdigest()
    return "array", array.dtype.str, array.shape, digest


def _fields(value: object, names: list[str]) -> list[tuple[str, object]]:
    return [(name, vars(value)[name]) for name in names if name in vars(value)]


@functools.lru_cache
def _source(code: type | Callable[..., object]) -> str:
    """Text of a class or function of the user."""
    if str(code.__module__).split(".")[0] in VERSIONED:
        return ""
    try:
        return inspect.getsource(code)
    except (OSError, TypeError):
        return ""  # typed into a notebook


class ArrayStore:
    """A folder with a NumPy file for each finished part, named by a hash of all its inputs.

    Each file holds its name too, so that one that was copied under another is not believed.
    Files are complete or absent: a run that is killed leaves at most a temporary file, which is
    never read, and two runs may share a folder.
    """

    def __init__(self, folder: str | Path):
        self.folder = Path(folder)
        _make_writable(self.folder)

    def __contains__(self, key: str) -> bool:
        """Whether there is a file, which may be damaged."""
        return self._path(key).exists()

    def keys(self) -> set[str]:
        """Names of all files."""
        return {path.stem for path in self.folder.glob("*.npz")}

    def read(self, key: str) -> dict[str, np.ndarray] | None:
        """Arrays by name; None if the file is missing or, with a warning, damaged."""
        path = self._path(key)
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        try:
            return _checked(content, key)
        except (OSError, RuntimeError, ValueError, KeyError, zipfile.BadZipFile) as error:
            warn(
                f"{path} is damaged ({error}). What it held is computed again, and it is replaced."
            )
            return None

    def write(self, key: str, arrays: Mapping[str, Any]) -> None:
        """Store arrays by name."""
        write_atomically(self._path(key), partial(np.savez, key=np.array(key), **arrays))

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.npz"


def _make_writable(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise InputError(
            f"store={str(folder)!r} is a file. A folder is needed, which is made if it does not "
            'exist, since each finished part is a file in it: store="finished".'
        )
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass  # fails here and not after the first part if the folder is not writable


def _checked(content: bytes, key: str) -> dict[str, np.ndarray]:
    """Arrays in a file, after a check of its check sums (CRC-32) and of its key."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        if archive.testzip() is not None:
            raise InputError("its numbers are not those that were written")
    with np.load(io.BytesIO(content)) as file:
        arrays = dict(file)
    if str(arrays.pop("key")) != key:
        raise InputError("it holds another part, which was copied under this name")
    return arrays
