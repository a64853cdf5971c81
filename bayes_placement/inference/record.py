"""What a result says of its origin: versions, date, seed or key, hashes of model and data."""

import pickle
from datetime import UTC, datetime
from importlib.metadata import version

import jax
import jax.numpy as jnp
import numpy as np

from .._shared.dimensions import Key
from .._shared.errors import InputError
from ..experiment.content_hash import content_hash
from ..experiment.experiment import Experiment

PACKAGES = ("bayes_placement", "numpyro", "jax", "numpy", "blackjax", "arviz-stats")


def versions() -> dict[str, str]:
    """Versions of this package and of those on which numbers depend, by name."""
    return {name: version(name) for name in PACKAGES}


def now() -> str:
    """Date and time in UTC, ISO 8601, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def origin(experiment: Experiment, measured: object) -> dict[str, str]:
    """Date, and hashes of the experiment and of what was measured.

    They are `date` in UTC, `experiment_sha256` and `measurement_sha256`; a hash is empty where an
    object of the user cannot be written to bytes.
    """
    return {
        "date": now(),
        "experiment_sha256": _hash_or_nothing(experiment),
        "measurement_sha256": _hash_or_nothing(measured),
    }


def record(experiment: Experiment, measured: object, seed: int = 0) -> dict[str, object]:
    """What a file of results says of its origin.

    Besides its origin the `versions`, the `seed` of all random numbers, 0 where a method takes
    none, since its own are fixed, and `units`: all numbers are in SI.
    """
    return {"versions": versions(), "seed": seed, "units": "SI", **origin(experiment, measured)}


def _hash_or_nothing(value: object) -> str:
    try:
        return content_hash(value)
    except (pickle.PicklingError, TypeError, AttributeError):  # such as an open file in an effect
        return ""


_LARGEST = 2**63
"""Integers below are attributes of files."""


def jax_key(key: object) -> Key:
    """Return the JAX key of a seed; a key stays as it is.

    A seed is an integer of Python or NumPy.
    """
    return jax.random.PRNGKey(_integer(key)) if _is_integer(key) else _checked(key)


def integer_seed(key: object) -> int:
    """Return the integer from which `numpy.random.default_rng` starts; see `jax_key`.

    That of `jax.random.key(3)` is 3.
    """
    if _is_integer(key):
        return _integer(key) % _LARGEST  # which takes no negative number
    seed = 0
    for word in _words(_checked(key)):
        seed = (seed << 32) + word
    return seed % _LARGEST


def recorded_seed(key: int | Key) -> int | list[int]:
    """Return what a file of results says of a seed: the integer, or the words of the key."""
    return int(key) if _is_integer(key) else _words(_checked(key))


def _is_integer(key: object) -> bool:
    if isinstance(key, bool | np.bool_):
        return False
    return isinstance(key, int | np.integer) or _is_array(key, 0, jnp.integer)


def _integer(key: int | Key) -> int:
    """Return an integer of 64 bits, as all generators take it."""
    if not -_LARGEST <= int(key) < _LARGEST:
        raise InputError(
            f"key={key!r} was given; an integer of 64 bits is needed, since the generators take no "
            "longer one: key=0."
        )
    return int(key)


def _checked(key: object) -> Key:
    if _is_array(key, 0, jax.dtypes.prng_key) or _is_array(key, 1, jnp.uint32):
        return key
    raise InputError(
        f"key={key!r} was given; an integer or one JAX key is needed, from which all random "
        "numbers follow: key=0 or key=jax.random.key(0)."
    )


def _is_array(key: object, dimensions: int, kind: type) -> bool:
    if not isinstance(key, jax.Array | np.ndarray):
        return False
    return key.ndim == dimensions and bool(jnp.issubdtype(key.dtype, kind))


def _words(key: Key) -> list[int]:
    typed = jnp.issubdtype(key.dtype, jax.dtypes.prng_key)
    return np.asarray(jax.random.key_data(key) if typed else key).tolist()
