"""`bayes-placement results`: what the results of each model are, how old and how large."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from ._result_folder import RECORD, RESULTS
from ._terminal import Screen
from ._user_cache import cache_home, files_of_fits

DAY, MEGABYTE = 86400.0, 1e6


class Kept(NamedTuple):
    """What the folder of a model holds: folders of runs, and their files."""

    folder: Path
    runs: list[Path]
    files: list[Path]

    def row(self) -> dict[str, str]:
        """Number of runs, age of the latest in days, and sizes in MB."""
        return {
            "runs": str(len(self.runs)),
            "latest [days]": f"{min(map(_age, self.runs)):.1f}",
            "results [MB]": f"{_megabytes(self.files):.1f}",
        }


def run(folder: Path | None, clean: bool, screen: Screen) -> None:
    """List the results of each model, and the fits of all; delete these where that is asked for.

    No result depends on fits. The folder has one for each model, by default `results`.
    """
    top = RESULTS if folder is None else folder
    kept = list(_kept_in(top))
    table = pd.DataFrame([model.row() for model in kept], [model.folder.name for model in kept])
    fits = files_of_fits()
    if kept:
        screen.table(table, "model")
    else:
        screen.text(f"No results are in {top}/.")
    verdict = _verdict(fits, clean)  # before they are deleted, with their size
    if clean:
        for file in fits:
            file.unlink(missing_ok=True)
    screen.always(verdict)
    rows = table.rename_axis("model").reset_index().to_dict("records")
    answer = {"command": "results", "finished": True, "verdict": verdict, "exit_code": 0}
    screen.json(
        {**answer, "files": [], "folder": str(top), "result": {"models": rows, "fits": len(fits)}}
    )


def _kept_in(top: Path) -> Iterator[Kept]:
    """Folders of models, each with at least one run."""
    for folder in sorted(path for path in top.glob("*") if path.is_dir()):
        runs = [path.parent for path in folder.glob(f"*/{RECORD}")]
        if runs:
            files = [file for run in runs for file in run.rglob("*") if file.is_file()]
            yield Kept(folder, runs, files)


def _verdict(fits: list[Path], clean: bool) -> str:
    """Number, size, age and place of fits, and what becomes of them."""
    if not fits:
        return f"No fits are kept in {cache_home()}."
    ages = sorted(map(_age, fits))
    size = f"{len(fits)} fit{'s' * (len(fits) > 1)}, {_megabytes(fits):.1f} MB"
    told = f"{size}, the oldest of {ages[-1]:.1f} days, in {cache_home()}"
    return f"Deleted: {told}." if clean else f"{told}; --clean deletes them, results stay."


def _age(path: Path) -> float:
    """Time since it was written last [days]; 0 once another run has deleted it."""
    try:
        return (time.time() - path.stat().st_mtime) / DAY
    except FileNotFoundError:
        return 0.0


def _megabytes(files: list[Path]) -> float:
    return sum(file.stat().st_size for file in files if file.exists()) / MEGABYTE
