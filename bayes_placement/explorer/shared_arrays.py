"""Messages between two processes that have the same large arrays, which are not sent again.

A finite element model has some 30 MB of them; each copy that a message made would stay.
"""

import hashlib
import io
import pickle
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import cloudpickle
import jax
import numpy as np

LARGE = 50_000
"""Bytes from which on an array is large."""

AnyArray: TypeAlias = np.ndarray | jax.Array


class SharedArrays:
    """Writes and reads objects of Python whose large arrays may be among those shared."""

    def __init__(self, arrays: Sequence[AnyArray]):
        self._arrays = arrays
        self._numbers = {_hash(array): number for number, array in enumerate(arrays)}

    def dumps(self, content: object) -> bytes:
        """Return an object as bytes; of arrays that are shared, their numbers."""
        file = io.BytesIO()
        _Pickler(file, lambda array: self._numbers.get(_hash(array))).dump(content)
        return file.getvalue()

    def loads(self, text: bytes) -> Any:
        """Return the object."""
        return _Unpickler(text, self._arrays).load()


def large_arrays(content: object) -> list[AnyArray]:
    """Return the large arrays of an object, which may be anywhere in it."""
    found: dict[bytes, AnyArray] = {}

    def note(array: AnyArray) -> int:
        found.setdefault(_hash(array), array)
        return 0  # so that none is written

    _Pickler(io.BytesIO(), note).dump(content)
    return [*found.values()]


class _Pickler(cloudpickle.Pickler):
    """Writes numbers in place of large arrays, where they have one."""

    def __init__(self, file: io.BytesIO, number_of: Callable[[AnyArray], int | None]):
        cloudpickle.Pickler.__init__(self, file)
        self._number_of = number_of

    def persistent_id(self, content: object) -> int | None:
        """Number of a large array that is shared; None for all else, which is written."""
        if not isinstance(content, AnyArray) or content.nbytes < LARGE:
            return None
        return self._number_of(content)


class _Unpickler(pickle.Unpickler):
    """Reads arrays by their numbers."""

    def __init__(self, text: bytes, arrays: Sequence[AnyArray]):
        pickle.Unpickler.__init__(self, io.BytesIO(text))
        self._arrays = arrays

    def persistent_load(self, number: int) -> AnyArray:
        """Array of a number."""
        return self._arrays[number]


def _hash(array: AnyArray) -> bytes:
    """Hash of numbers, shape and kind of an array."""
    content = np.ascontiguousarray(array)
    words = f"{type(array).__module__} {content.dtype} {content.shape}".encode()
    found = hashlib.blake2b(words, digest_size=16)
    found.update(content.reshape(-1).view(np.uint8).data)
    return found.digest()
