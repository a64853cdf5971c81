"""MDF files (versions 3 and 4) of vehicle tests, by asammdf."""

import importlib.util
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..._types import InputError, MissingExtraError
from .clock import rate_of_times
from .sampled import Sampled


def load(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels by their names, with unit and the rate of their time stamps.

    Raises
    ------
    MissingExtraError
        If asammdf is not installed.
    InputError
        If a name stands for several channels, or time stamps are not even.
    """
    if importlib.util.find_spec("asammdf") is None:
        raise MissingExtraError(
            f"{path} cannot be read, since asammdf is not installed, which knows MDF files. "
            'Install it: pip install "bayes_placement[mdf]".'
        )
    from asammdf import MDF

    with MDF(path) as file:
        signals = {name: _signal(file, name) for name in names if name in file.channels_db}
        others = {name: np.empty(0) for name in file.channels_db}
    _check_times(signals)
    return Sampled(
        arrays={**others, **{name: np.asarray(signal.samples) for name, signal in signals.items()}},
        units={name: signal.unit for name, signal in signals.items()},
        rates={name: rate_of_times(signal.timestamps) for name, signal in signals.items()},
    )


def _signal(file: Any, name: str) -> Any:
    """Channel of a name that stands once."""
    places = file.channels_db[name]
    if len(places) > 1:
        raise InputError(
            f"{len(places)} channels are named {name!r}, in the groups "
            f"{', '.join(str(group) for group, _ in places)}; one is needed, since any could be "
            "meant. Export the one that is wanted under a name of its own."
        )
    ((group, index),) = places
    return file.get(name, group=group, index=index)


def _check_times(signals: dict[str, Any]) -> None:
    """Refuse channels of which one began later than another."""
    starts = {name: float(signal.timestamps[0]) for name, signal in signals.items()}
    if starts and max(starts.values()) - min(starts.values()) > 0:
        late = max(starts, key=lambda name: starts[name])
        raise InputError(
            f"{late!r} begins at {starts[late]:g} s and another channel at "
            f"{min(starts.values()):g} s; one start is needed, since force and response are "
            "compared in time. Export them on one time axis (MDF.resample)."
        )
