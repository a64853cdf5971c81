"""`bayes-placement results`: what the results of each model are, how old and how large."""

import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from ._result_folder import RECORD, RESULTS
from ._shared_fits import FITS
from ._terminal import Screen

FIT = re.compile(r"[0-9a-f]{64}\.npz")
"""Names of fits, which are hashes; nothing else is deleted."""

DAY, MEGABYTE = 86400.0, 1e6


class Kept(NamedTuple):
    """What the folder of a model holds.

    Parameters
    ----------
    folder
        The folder.
    runs
        Folders of its runs.
    files
        Files of these runs.
    fits
        Files of fits, which a later run makes again where they are missing.
    """

    folder: Path
    runs: list[Path]
    files: list[Path]
    fits: list[Path]

    def row(self) -> dict[str, str]:
        """Number of runs, age of the latest in days, and sizes in MB."""
        latest = max(run.stat().st_mtime for run in self.runs)
        return {
            "runs": str(len(self.runs)),
            "latest [days]": f"{(time.time() - latest) / DAY:.1f}",
            "results [MB]": f"{_megabytes(self.files):.1f}",
            "fits": str(len(self.fits)),
            "fits [MB]": f"{_megabytes(self.fits):.1f}",
        }


def run(folder: Path | None, clean: bool, screen: Screen) -> None:
    """List the results of each model; delete their fits where that is asked for.

    Parameters
    ----------
    folder
        Folder with a folder for each model; None for `results`.
    clean
        Whether to delete fits, of which no result depends.
    screen
        Where it is shown.
    """
    top = RESULTS if folder is None else folder
    kept = list(_kept_in(top))
    table = pd.DataFrame([model.row() for model in kept], [model.folder.name for model in kept])
    fits = [file for model in kept for file in model.fits]
    if kept:
        screen.table(table, "model")
    else:
        screen.text(f"No results are in {top}/.")
    size = f"{len(fits)} fits, {_megabytes(fits):.1f} MB"
    if clean:
        for file in fits:
            file.unlink(missing_ok=True)
    verdict = f"Deleted: {size}." if clean else f"{size}, which --clean deletes; results stay."
    screen.always(verdict)
    rows = table.rename_axis("model").reset_index().to_dict("records")
    answer = {"command": "results", "finished": True, "verdict": verdict, "exit_code": 0}
    screen.json({**answer, "files": [], "folder": str(top), "result": {"models": rows}})


def _kept_in(top: Path) -> Iterator[Kept]:
    """Folders of models, each with at least one run."""
    for folder in sorted(path for path in top.glob("*") if path.is_dir()):
        runs = [path.parent for path in folder.glob(f"*/{RECORD}")]
        if runs:
            files = [file for run in runs for file in run.rglob("*") if file.is_file()]
            fits = [file for file in (folder / FITS).glob("*") if FIT.fullmatch(file.name)]
            yield Kept(folder, runs, files, fits)


def _megabytes(files: list[Path]) -> float:
    return sum(file.stat().st_size for file in files) / MEGABYTE
