"""Reads files of data recorders by their libraries, in a separate process: see `../_child.py`."""

from collections.abc import Mapping
from typing import Any

import numpy as np

TIMES = "times of group {}"
_EPOCH = np.datetime64("1970-01-01T00:00:00")


def read(path: str, extra: str) -> tuple[dict[str, np.ndarray], dict[str, dict[str, object]]]:
    """Samples by name, with what the file states of them, and what was left out."""
    return {"tdms": _tdms, "mdf": _mdf}[extra](path)


def _tdms(path: str) -> tuple[dict[str, np.ndarray], dict[str, dict[str, object]]]:
    """Samples by `group/channel`, with units, rates, starts [s] and what was left out."""
    from nptdms import TdmsFile

    arrays: dict[str, np.ndarray] = {}
    metadata: dict[str, dict[str, object]] = {"units": {}, "rates": {}, "starts": {}, "faults": {}}
    for group in TdmsFile.read(path).groups():
        for channel in group.channels():
            name = f"{group.name}/{channel.name}"
            samples = np.asarray(channel[:])
            if samples.dtype.kind not in "iuf" or not samples.size:
                metadata["faults"][name] = "it holds no numbers"
                continue
            arrays[name] = samples
            metadata["units"][name] = str(channel.properties.get("unit_string", ""))
            step = float(channel.properties.get("wf_increment", 0.0))
            if step > 0:
                metadata["rates"][name] = 1 / step
                metadata["starts"][name] = _start(channel.properties)
    return arrays, metadata


def _start(properties: Mapping[str, Any]) -> float:
    """Time of the first sample [s], since the epoch where the file states a date."""
    date = np.datetime64(properties.get("wf_start_time", _EPOCH))
    return (date - _EPOCH) / np.timedelta64(1, "s") + properties.get("wf_start_offset", 0.0)


def _mdf(path: str) -> tuple[dict[str, np.ndarray], dict[str, dict[str, object]]]:
    """Samples by name and times by group, with units, groups and what was left out."""
    from asammdf import MDF

    arrays: dict[str, np.ndarray] = {}
    metadata: dict[str, dict[str, object]] = {"units": {}, "groups": {}, "faults": {}}
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
