"""Measurements in the order of the force levels of an experiment."""

from collections.abc import Sequence
from typing import Any

from .._shared.arguments import check_kind
from .._shared.errors import InputError
from .measurement import Measurement
from .modal_parameters import ModalParameters


def at_levels(
    measurements: Measurement | ModalParameters | Sequence[Measurement],
    levels: Sequence[float] | None,
) -> list[Measurement]:
    """Measurements in the order of some force levels [N].

    There is none for a single measurement at whatever level.
    """
    single = isinstance(measurements, Measurement | ModalParameters)
    entries: Any = [measurements] if single else measurements
    for run in entries if isinstance(entries, list | tuple) else [entries]:
        check_kind(
            "measurement",
            run,
            Measurement,
            "measured FRFs are needed, with their channels and lines",
            "io.read_measurement(path), or Measurement.from_arrays(...)",
        )
    runs = list(entries)
    if levels is None:
        if len(runs) != 1:
            raise InputError(
                f"{len(runs)} measurements were given to an experiment without force levels, "
                "which has one. Say how hard each was driven: "
                "Experiment(..., force_levels=[0.1, 1.0])."
            )
        return runs
    by_level = {run.force_level: run for run in runs}
    missing = [level for level in levels if level not in by_level]
    if missing:
        stated = ", ".join("none stated" if level is None else f"{level:g} N" for level in by_level)
        raise InputError(
            f"The experiment has the force level {missing[0]:g} N, but the measurements given have "
            f"{stated}. Give one measurement for each level: Measurement.from_arrays(..., "
            f"force_level={missing[0]:g})."
        )
    return [by_level[level] for level in levels]
