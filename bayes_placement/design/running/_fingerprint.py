"""_fingerprint: in, whatever determines a result; out, a hash of its content.

Not known here: what is computed. Equal content has one hash in every process and on every day.
"""

import dataclasses
import functools
import hashlib
import inspect
import pickle
from collections.abc import Iterator
from typing import Any

import jax
import numpy as np
from numpyro.distributions import Distribution
from numpyro.distributions.constraints import Constraint
from numpyro.distributions.transforms import Transform


def fingerprint(*parts: Any) -> str:
    """Hash of numbers, words, laws and modules, with all that they hold, static or not."""
    found = hashlib.sha256()
    for piece in _pieces(parts):
        found.update(len(piece).to_bytes(8, "little") + piece)  # no piece runs into the next
    return found.hexdigest()


def _pieces(value: Any) -> Iterator[bytes]:
    kind: Any = type(value)
    yield f"{kind.__module__}.{kind.__qualname__}".encode()
    if isinstance(value, np.ndarray | np.generic | jax.Array | bool | int | float | complex):
        yield from _array(np.asarray(value))
    elif isinstance(value, str | bytes | None):
        yield value.encode() if isinstance(value, str) else value or b""
    else:
        held = _held(value)
        yield str(len(held)).encode()
        for one in held:
            yield from _pieces(one)


def _array(value: np.ndarray) -> Iterator[bytes]:
    if value.dtype.hasobject:
        yield from _pieces(value.tolist())  # its bytes would be addresses
    else:
        yield from (value.dtype.str.encode(), str(value.shape).encode(), value.tobytes())


def _held(value: Any) -> list[Any]:
    """Parts of which a value is made."""
    kind: Any = type(value)
    if isinstance(value, dict):
        return list(value.items())
    if isinstance(value, tuple | list):
        return list(value)
    if isinstance(value, set | frozenset):
        return sorted(map(fingerprint, value))
    if isinstance(value, Distribution):
        return _law(value)
    if isinstance(value, Transform | Constraint):
        return [_source(kind), *value.tree_flatten()]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        own = vars(value)
        names = [field.name for field in dataclasses.fields(value) if field.name in own]
        return [_source(kind), *((name, own[name]) for name in names)]
    if callable(value):
        return [value.__module__, value.__qualname__, _source(value)]
    return [pickle.dumps(value)]


def _law(law: Distribution) -> list[Any]:
    """Fields that NumPyro counts as content; it collects them in a set, in no order."""
    own = vars(law)
    kind: Any = type(law)
    names = {*kind.gather_pytree_data_fields(), *kind.gather_pytree_aux_fields()}
    return [_source(kind), *((name, own[name]) for name in sorted(names & set(own)))]


@functools.lru_cache
def _source(thing: Any) -> str:
    """Text of a class or function of the user; the key holds the version of this package."""
    if thing.__module__.split(".")[0] in ("bayes_placement", "numpyro", "jax", "builtins"):
        return ""
    try:
        return inspect.getsource(thing)
    except (OSError, TypeError):
        return ""  # typed into a notebook
