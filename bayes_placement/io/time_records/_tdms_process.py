"""Reads TDMS files by npTDMS, in a process of its own: see `../_child.py`."""

from typing import Any

import numpy as np
from nptdms import TdmsFile


def read(path: str) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Samples by `group/channel`, with units, sampling rates and what was left out."""
    arrays: dict[str, np.ndarray] = {}
    told: dict[str, Any] = {"units": {}, "rates": {}, "faults": {}}
    for group in TdmsFile.read(path).groups():
        for channel in group.channels():
            name = f"{group.name}/{channel.name}"
            samples = np.asarray(channel[:])
            if samples.dtype.kind not in "iuf" or not samples.size:
                told["faults"][name] = "it holds no numbers"
                continue
            arrays[name] = samples
            told["units"][name] = str(channel.properties.get("unit_string", ""))
            step = float(channel.properties.get("wf_increment", 0.0))
            if step > 0:
                told["rates"][name] = 1 / step
    return arrays, told
