"""The case folder of a completed model: the case, and the effects that its model lacked."""

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..._shared.files import write_json
from ...effects.effect import Effect
from ...experiment.experiment import Experiment
from ._effects import FIELD, stated_effects
from ._inside import measured_files, model_files

CASE, MODEL = "case.json", "nominal_fe_model"


def write_completed(
    folder: Path, case: Path, experiment: Experiment, effects: Sequence[Effect]
) -> Path:
    """Copy the files of a case and of the finite element model that it names, and add effects.

    `case.json` comes last, so that a folder that has it is complete.

    Parameters
    ----------
    folder
        The new folder.
    case
        The folder of the case.
    experiment
        The experiment of the case.
    effects
        Default candidates and networks that are added to it.
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
