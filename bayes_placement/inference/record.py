"""What a result says of its origin: versions, date, seed, and hashes of model and data."""

import pickle
from datetime import UTC, datetime
from importlib.metadata import version

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
