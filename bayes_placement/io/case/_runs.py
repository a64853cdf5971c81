"""Measured files of a case: one for each state and force level, and the noise that they tell."""

import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._shared.files import Json, write_json
from ...effects.effect import Effect
from ...experiment._measurement_checks import LINE_TOLERANCE
from ...experiment.experiment import Experiment
from ...experiment.measurement import Measurement
from ...experiment.noise import Noise
from ._effects import FIELD, stated_effects
from ._json_fields import CaseError
from ._measurement import MeasurementSettings, noise_by_data, read_run

MODEL_FILES = ("nominal.npz", "model.json", "K.npz", "M.npz")
"""Files of a finite element model that are always read."""


def inside(folder: Path, name: str) -> Path:
    """Path of a file in a folder."""
    path = folder / name
    # Path.resolve would fail where links lead to each other, which is told where they are opened.
    target, home = (Path(os.path.realpath(each)) for each in (path, folder))
    if not target.is_relative_to(home):
        raise CaseError(
            f"{path} is a link to {target}, which is outside the folder; a file in it is "
            "needed, since a case opens nothing else: put a copy in the place of the link."
        )
    return path


def measured_files(folder: Path, content: Json) -> Iterator[Path]:
    """Universal files of a case that are there: those that its content names, and of each level."""
    stated = content["measurement"]
    states = [name for state in stated.get("states") or [] for name in state["files"]]
    levels = [path.name for path in sorted(folder.glob("measured_level*.uff"))]
    names = ["measured.uff", *levels, *(stated.get("baseline_files") or []), *states]
    paths = (inside(folder, name) for name in dict.fromkeys(names) if name.endswith(".uff"))
    yield from (path for path in paths if path.is_file())


def model_files(folder: Path) -> Iterator[Path]:
    """Files of a finite element model that are there."""
    regions = [path.name for path in sorted(folder.glob("K_region_*.npz"))]
    paths = (inside(folder, name) for name in (*MODEL_FILES, *regions))
    yield from (path for path in paths if path.is_file())


CASE, MODEL = "case.json", "nominal_fe_model"


def write_completed(
    folder: Path, case: Path, experiment: Experiment, effects: Sequence[Effect]
) -> Path:
    """Copy the files of a case and of the finite element model that it names, and add effects.

    `case.json` comes last, so that a folder that has it is complete.
    """
    content: Json = json.loads((case / CASE).read_text(encoding="utf-8-sig"))
    content[FIELD] = [*(content.get(FIELD) or []), *stated_effects(experiment, effects)]
    folder.mkdir(parents=True)
    for file in measured_files(case, content):
        shutil.copyfile(file, folder / file.name)
    if content.get(MODEL) is not None:
        (folder / MODEL).mkdir()
        for file in model_files(case.resolve() / content[MODEL]):
            shutil.copyfile(file, folder / MODEL / file.name)
        content[MODEL] = MODEL
    return write_json(folder / CASE, content)


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
