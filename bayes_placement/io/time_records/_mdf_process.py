"""Reads MDF files by asammdf, in a separate process: see `../_child.py`."""

from typing import Any

import numpy as np
from asammdf import MDF

TIMES = "times of group {}"


def read(path: str) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Samples by name and times by group, with units, groups and what was left out."""
    arrays: dict[str, np.ndarray] = {}
    metadata: dict[str, Any] = {"units": {}, "groups": {}, "faults": {}}
    with MDF(path) as file:
        for name, places in file.channels_db.items():
            if len(places) > 1:
                groups = ", ".join(str(group) for group, _ in places)
                metadata["faults"][name] = (
                    f"{len(places)} channels have this name, in groups {groups}"
                )
                continue
            ((group, index),) = places
            signal = file.get(name, group=group, index=index)
            samples = np.asarray(signal.samples)
            if samples.dtype.kind not in "iuf" or samples.ndim != 1 or not samples.size:
                metadata["faults"][name] = "it holds no numbers in a row"
                continue
            arrays[name] = samples
            arrays[TIMES.format(group)] = np.asarray(signal.timestamps)
            metadata["units"][name] = str(signal.unit or "")
            metadata["groups"][name] = group
    return arrays, metadata
