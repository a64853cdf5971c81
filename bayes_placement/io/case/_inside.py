"""Files of a case: all lie in its folder, or in that of the finite element model that it names."""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

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
