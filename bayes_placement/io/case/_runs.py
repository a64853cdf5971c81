"""Measurements of a case: one for each state and force level, and the noise that they tell."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...experiment._measurement_checks import LINE_TOLERANCE
from ...experiment.measurement import Measurement
from ...experiment.noise import Noise
from ._files import inside
from ._json_fields import CaseError
from ._measurement import MeasurementSettings, read_run
from ._noise import noise_by_data

Runs = tuple[Measurement, ...]
"""One measurement for each force level; a single one where there are no force levels."""


class CaseRuns(NamedTuple):
    """What the universal files of a case hold.

    `baseline` is an earlier state, `states` are several by label, the baseline first; both may be
    empty. `noise` is as the case states it or as the files tell.
    """

    measured: Runs
    baseline: Runs
    states: Mapping[str, Runs]
    noise: Noise


def read_runs(folder: Path, settings: MeasurementSettings) -> CaseRuns:
    """Read all universal files of a case."""
    levels = settings.force_levels or (None,)
    names = ["measured.uff", *(f"measured_level{n}.uff" for n in range(2, len(levels) + 1))]
    wanted = f"one file for each of {len(levels)} force levels" if len(levels) > 1 else "one file"
    reason = (
        f"measurement.force_levels_N in {settings.file} asks for {wanted}: measured.uff, then "
        "measured_level2.uff and so on"
    )
    further = folder / f"measured_level{len(levels) + 1}.uff"
    if further.exists():
        raise CaseError(
            f"{further} is there, but measurement.force_levels_N in {settings.file} asks for "
            f"{wanted}; a level for each file is needed, since a nonlinear response depends on it. "
            "Give the levels of all files, or take the file out of the folder."
        )
    measured = _read(folder, settings, names, reason)
    _check_lines(folder, names, measured)
    noise = settings.noise or noise_by_data(measured)
    baseline: Runs = ()
    if settings.baseline:
        baseline = _of_state(folder, settings, "baseline_files", settings.baseline)
    states = {
        label: _of_state(folder, settings, f'states, "{label}",', files)
        for label, files in settings.states.items()
    }
    _check_noise(folder, noise, [(names, measured), (settings.baseline, baseline)])
    _check_noise(folder, noise, [(settings.states[label], states[label]) for label in states])
    return CaseRuns(measured, baseline, states, noise)


def _of_state(
    folder: Path, settings: MeasurementSettings, field: str, names: Sequence[str]
) -> Runs:
    """Read the files of an earlier or later state."""
    levels = settings.force_levels or (None,)
    if len(levels) != len(names):
        raise CaseError(
            f"{settings.file}: measurement.{field} names {len(names)} universal files, but "
            f'{len(levels)} are needed, one for each force level: ["baseline.uff"].'
        )
    reason = f"measurement.{field} in {settings.file} names it"
    return _read(folder, settings, names, reason)


def _read(folder: Path, settings: MeasurementSettings, names: Sequence[str], reason: str) -> Runs:
    for name in names:
        if not inside(folder, name).is_file():
            raise FileNotFoundError(
                f"There is no file {folder / name}, and {reason}. Put the file there, or correct "
                "that field."
            )
    levels = settings.force_levels or (None,)
    return tuple(
        read_run(folder / name, settings, level) for name, level in zip(names, levels, strict=True)
    )


def _check_lines(folder: Path, names: Sequence[str], measured: Runs) -> None:
    """Refuse force levels that were measured at other lines."""
    for name, measurement in zip(names, measured, strict=True):
        lines, first = measurement.frequency, measured[0].frequency
        if not np.allclose(lines, first, rtol=LINE_TOLERANCE, atol=0.0):
            raise CaseError(
                f"{folder / name} and {folder / names[0]} have other lines in the same band; one "
                "frequency axis is needed for all force levels, since they are compared line by "
                "line. Export both on the same lines."
            )


def _check_noise(folder: Path, noise: Noise, files: Sequence[tuple[Sequence[str], Runs]]) -> None:
    """Refuse a measurement whose noise is not known, where that of others is."""
    for names, runs in files:
        for name, run in zip(names, runs, strict=True):
            try:
                noise.variance(run)
            except ValueError as error:
                raise CaseError(
                    f"{folder / name} does not state its noise: {error} A case needs the coherence "
                    "of every FRF (dataset 58, function type 6) or of none, since its noise "
                    'follows from it; or "noise_level" in "measurement".'
                ) from error
