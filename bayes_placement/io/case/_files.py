"""Files of a case: those in its folder, and a copy with the effects that the model lacked."""

import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..._shared.files import write_json
from ...effects.effect import Effect
from ...experiment.experiment import Experiment
from ._effects import FIELD, stated_effects
from ._json_fields import CaseError

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


def measured_files(folder: Path, content: Mapping[str, Any]) -> Iterator[Path]:
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
    content: dict[str, Any] = json.loads((case / CASE).read_text(encoding="utf-8-sig"))
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
