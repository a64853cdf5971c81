"""TDMS files of LabVIEW, by npTDMS."""

import importlib.util
from collections.abc import Iterable
from pathlib import Path

from ..._types import MissingExtraError
from .sampled import Sampled


def load(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels, whose names are `group/channel`, with unit and sampling interval.

    Raises
    ------
    MissingExtraError
        If npTDMS is not installed.
    """
    if importlib.util.find_spec("nptdms") is None:
        raise MissingExtraError(
            f"{path} cannot be read, since npTDMS is not installed, which knows TDMS files. "
            'Install it: pip install "bayes_placement[tdms]".'
        )
    from nptdms import TdmsFile

    channels = {
        f"{group.name}/{channel.name}": channel
        for group in TdmsFile.read(path).groups()
        for channel in group.channels()
    }
    stated = {name: channel.properties.get("unit_string", "") for name, channel in channels.items()}
    steps = {name: channel.properties.get("wf_increment", 0) for name, channel in channels.items()}
    return Sampled(
        arrays={name: channel[:] for name, channel in channels.items()},
        units={name: str(unit) for name, unit in stated.items()},
        rates={name: 1 / float(step) for name, step in steps.items() if step > 0},
    )
